"""A World as a MuJoCo model: its structure is compiled once, and its numbers are written for each world.

These are masses, inertias, joints, motors, materials and gravity. All of a group is written from the world alone, so a
model that had another world is the same to the bit.
"""

from collections.abc import Callable, Mapping, Sequence
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.mujoco.law import EACH_DAMPER, EACH_MOTOR, EACH_STICKER, FALL, FIRST, PD, Servo, settings
from gaplab.services.world.inertias import inertia_of
from gaplab.services.world.kinematics import outwards
from gaplab.services.world.sensing import gravity_m_s2
from gaplab.services.world.world import (
    UNTURNED,
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Material,
    Motor,
    Part,
    PDLaw,
    PDMotor,
    Quaternion,
    Sphere,
    Vector,
    World,
    pd_law,
)

GROUND = "the ground"

RIGID = (0.9999, 0.9999, 1.0, 0.5, 1.0)
"""Impedance of a contact, a limit or dry friction: almost rigid, at any depth."""

UNUSED = (-1.0, -1.0)
"""Spring and damper in MuJoCo's direct format, which the law does not use."""

FASTEST = 30.0
"""Speed up to which a joint stops at its limit, rad/s or m/s; a faster one is pushed back from beyond it."""

TURNED = (0.6, 0.0, 0.0, 0.8)
"""The turn of any inertia in the compiled model, w, x, y, z: MuJoCo then takes no shortcut that the written one may not
permit."""

FREE_DOFS, FREE_POSITIONS = 6, 7
"""Degrees of freedom of a free base, and positions in a state."""

SWITCHED_OFF = (
    "mjDSBL_AUTORESET",  # a diverged simulation stays visible
    "mjDSBL_WARMSTART",  # its solver has no work
    "mjDSBL_REFSAFE",
    "mjDSBL_EULERDAMP",
    "mjDSBL_ISLAND",
    "mjDSBL_MIDPHASE",
    "mjDSBL_SENSOR",
    "mjDSBL_SPRING",
    "mjDSBL_DAMPER",
    "mjDSBL_EQUALITY",
)
"""Features of MuJoCo that a World does not need."""


class Structure(NamedTuple):
    """A compiled model, and where it has the parts of a world.

    Attributes:
        bodies: `(b,)`: its indices of the world's bodies.
        dofs: `(j,)`: degrees of freedom of the world's joints.
        joints: `(j,)`: its indices of the world's joints.
        ahead: number of positions, less that of degrees of freedom.
        pairs: index of the world's body, of each pair of shapes that may collide.
        solids: bodies of one shape that collides: index of the body, index of its geometry, and place and turn that
            MuJoCo gave it in the frame of the shape.
    """

    model: Any
    bodies: NDArray[np.int_]
    dofs: NDArray[np.int_]
    joints: NDArray[np.int_]
    ahead: int
    pairs: tuple[int, ...]
    solids: tuple[tuple[int, int, FloatArray, Quaternion], ...]


def compiled(mujoco: ModuleType, world: World) -> Structure:
    """Compile the structure of a world."""
    spec = mujoco.MjSpec()
    _set_up_physics(mujoco, spec, world)
    spec.worldbody.add_geom(name=GROUND, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], contype=0, conaffinity=0)
    _complete(spec, add_bodies(mujoco, spec, world, named), world)
    geoms = [
        (at, _add_part(mujoco, spec, world.bodies[at].name, number, part))
        for at in range(int(world.fixed), len(world.bodies))  # what never moves can't collide
        for number, part in enumerate(world.bodies[at].parts)
        if part.collides
    ]
    model = spec.compile()
    return _structure(world, model, [(at, model.geom(name).id) for at, name in geoms])


def named(body: str) -> str:
    """Return MuJoCo's name of a body: its ground is a body too, named "world"."""
    return f"body {body}"


def scalar_first(turn: Quaternion) -> list[float]:
    """Return a quaternion x, y, z, w as MuJoCo's w, x, y, z."""
    return [turn[3], turn[0], turn[1], turn[2]]


def _scalar_last(turn: FloatArray) -> Quaternion:
    w, x, y, z = turn.tolist()
    return x, y, z, w


def _structure(world: World, model: Any, geoms: list[tuple[int, int]]) -> Structure:
    order = [world.joints[number] for number in outwards(world)]
    places = {joint.name: place for place, joint in enumerate(order)}
    carried = {joint.child: place + 2 for place, joint in enumerate(order)}  # the ground is 0, the base 1
    joints = np.array([places[joint.name] for joint in world.joints], int)
    solids = [
        (at, geom, model.geom_pos[geom] - np.array(world.bodies[at].center_m), _scalar_last(model.geom_quat[geom]))
        for at, geom in geoms
        if not isinstance(world.bodies[at].shape, tuple)
    ]
    return Structure(
        model=model,
        bodies=np.array([1, *(carried[body.name] for body in world.bodies[1:])]),
        dofs=joints + (0 if world.fixed else FREE_DOFS),
        joints=joints + (0 if world.fixed else 1),
        ahead=0 if world.fixed else FREE_POSITIONS - FREE_DOFS,
        pairs=tuple(at for at, _ in geoms),
        solids=tuple(solids),
    )


def _set_up_physics(mujoco: ModuleType, spec: Any, world: World) -> None:
    option = spec.option
    option.timestep = world.time_step_s
    option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    option.solver = mujoco.mjtSolver.mjSOL_PGS  # unused, but it makes MuJoCo compute the inverse inertia at contacts
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    option.disableflags = sum(int(getattr(mujoco.mjtDisableBit, each)) for each in SWITCHED_OFF)
    spec.compiler.autolimits = False
    spec.add_numeric(name="settings", size=FIRST + (EACH_MOTOR + EACH_DAMPER + EACH_STICKER) * len(world.joints))
    spec.add_sensor(
        name="accelerations",
        type=mujoco.mjtSensor.mjSENS_USER,
        dim=len(world.joints) + (0 if world.fixed else FREE_DOFS),
        needstage=mujoco.mjtStage.mjSTAGE_ACC,
        datatype=mujoco.mjtDataType.mjDATATYPE_REAL,
    )


def add_bodies(mujoco: ModuleType, spec: Any, world: World, name_of: Callable[[str], str]) -> dict[str, Any]:
    """Add the bodies with their joints, depth first, without mass; return them by their names in the world."""
    base, start = world.bodies[0].name, [0.0, 0.0, world.start_height_m]
    made = {base: spec.worldbody.add_body(name=name_of(base), pos=start, quat=scalar_first(world.start_turn))}
    if not world.fixed:
        made[base].add_freejoint()
    for joint in (world.joints[number] for number in outwards(world)):
        place = {"pos": joint.origin_m, "quat": scalar_first(joint.turn)}
        made[joint.child] = made[joint.parent].add_body(name=name_of(joint.child), **place)
        kind = mujoco.mjtJoint.mjJNT_SLIDE if joint.slides else mujoco.mjtJoint.mjJNT_HINGE
        made[joint.child].add_joint(name=joint.name, type=kind, axis=joint.axis)
    return made


def _complete(spec: Any, made: Mapping[str, Any], world: World) -> None:
    """Give bodies an inertia that takes any center and any turn, and joints their limits' law."""
    for body in made.values():
        body.mass, body.inertia, body.explicitinertial = 1.0, [1.0] * 3, True
        body.ipos, body.iquat = [1e-3, 0.0, 0.0], TURNED
    for each in world.joints:
        joint = spec.joint(each.name)
        joint.margin, joint.solimp_limit, joint.solimp_friction = FASTEST * world.time_step_s, RIGID, RIGID


def _add_part(mujoco: ModuleType, spec: Any, body: str, number: int, part: Part) -> str:
    """Add a shape, and its contacts with the ground, with friction in two directions; return its name."""
    name = f"{body}/{number}"
    add_geom(mujoco, spec, spec.body(named(body)), name, part)
    spec.add_pair(
        geomname1=GROUND,
        geomname2=name,
        condim=3,
        friction=np.ones(5),
        solref=UNUSED,
        solreffriction=UNUSED,
        solimp=RIGID,
    )
    return name


def add_geom(mujoco: ModuleType, spec: Any, body: Any, name: str, part: Part) -> Any:
    """Add a shape without mass that collides only in declared pairs, and return it."""
    kinds, shape = mujoco.mjtGeom, part.shape
    place: dict[str, Any] = {"name": name, "pos": part.center_m, "quat": scalar_first(part.turn)}
    place |= {"mass": 0.0, "contype": 0, "conaffinity": 0}
    match shape:
        case Box():
            return body.add_geom(type=kinds.mjGEOM_BOX, size=[edge / 2 for edge in shape.size_m], **place)
        case Sphere():
            return body.add_geom(type=kinds.mjGEOM_SPHERE, size=[shape.radius_m, 0.0, 0.0], **place)
        case Capsule():
            return body.add_geom(type=kinds.mjGEOM_CAPSULE, size=[shape.radius_m, shape.length_m / 2, 0.0], **place)
        case Cylinder():
            return body.add_geom(type=kinds.mjGEOM_CYLINDER, size=[shape.radius_m, shape.length_m / 2, 0.0], **place)
        case Hull():
            spec.add_mesh(name=name, uservert=np.ravel(shape.points_m).astype(float))
            return body.add_geom(type=kinds.mjGEOM_MESH, meshname=name, **place)


ROTOR = 8.0
"""Inertia of a servo's rotor, relative to that of what its joint carries in the zero pose: in one step a free limb
reaches eight ninths of the target speed. The rank correlation with PyBullet over random gaits was 0.78; with 2, 4, 16
and 32 it was 0.41, 0.72, 0.66 and 0.57."""

IN_PLACE, SAME_TURN, ANYWHERE = 1, 3, 0
"""MuJoCo's values of `sameframe`: frames are equal, only their turns are, or neither."""


def write(mujoco: ModuleType, structure: Structure, model: Any, data: Any, world: World, before: World | None) -> None:
    """Write a world into a copy of its structure's model, which has the world before; None if it has none."""
    other_bodies = before is None or world.bodies is not before.bodies
    if other_bodies:
        _write_bodies(structure, model, world)
    if other_bodies or before is None or world.joints is not before.joints:
        _write_joints(mujoco, structure, model, data, world)
    model.numeric_data[FALL] = abs(world.gravity_m_s2) * world.time_step_s
    model.opt.gravity[:] = gravity_m_s2(world)
    model.geom_pos[0, 2] = world.ground_m  # the first geometry is the ground
    model.geom_sameframe[0] = _sameframe((0.0, 0.0, world.ground_m), UNTURNED)
    _paint(structure, model, world)


def _paint(structure: Structure, model: Any, world: World) -> None:
    """Write materials into the pairs of a model, where the law reads them."""
    if not world.surfaces:
        model.pair_friction[:] = _coefficients(world.material)
        return
    surfaces = {name: _coefficients(material) for name, material in world.surfaces}
    plain = _coefficients(world.material)
    coefficients = [surfaces.get(world.bodies[body].surface, plain) for body in structure.pairs]
    model.pair_friction[:] = coefficients or np.empty((0, 5))


def start(structure: Structure, world: World) -> FloatArray:
    """Return `(positions,)`: those of the start."""
    found = np.array(structure.model.qpos0)
    found[structure.dofs + structure.ahead] = [joint.start for joint in world.joints]
    return found


def _coefficients(material: Material) -> tuple[float, ...]:
    """Return a contact's five coefficients, at STATIC (twice), DYNAMIC and RESTITUTION."""
    dynamic = material.dynamic_friction
    static = max(material.static_friction, dynamic)
    return static, static, dynamic, material.restitution, 0.0


def _write_bodies(structure: Structure, model: Any, world: World) -> None:
    all_bodies, at = [inertial(body) for body in world.bodies], structure.bodies
    model.body_mass[at] = [body.mass_kg for body in world.bodies]
    model.body_ipos[at] = [center for center, _, _ in all_bodies]
    model.body_inertia[at] = [moments for _, moments, _ in all_bodies]
    model.body_iquat[at] = [scalar_first(turn) for _, _, turn in all_bodies]
    model.body_sameframe[at] = [_sameframe(center, turn) for center, _, turn in all_bodies]
    for body, geom, offset, turn in structure.solids:
        place = np.array(world.bodies[body].center_m) + offset
        model.geom_pos[geom] = place
        model.geom_sameframe[geom] = _sameframe(place, turn)


def _sameframe(place: Sequence[float] | FloatArray, turn: Quaternion) -> int:
    if turn != UNTURNED:
        return ANYWHERE
    return SAME_TURN if any(place) else IN_PLACE


def inertial(body: Body) -> tuple[Vector, Vector, Quaternion]:
    """Return center, principal moments, and their turn; those of boxes and balls are MuJoCo's to the bit."""
    shape, mass = None if body.inertia is not None else body.shape, body.mass_kg
    if isinstance(shape, Box):
        x, y, z = (edge / 2 * (edge / 2) for edge in shape.size_m)
        return body.center_m, (mass * (y + z) / 3, mass * (x + z) / 3, mass * (x + y) / 3), UNTURNED
    if isinstance(shape, Sphere):
        return body.center_m, (2 * mass * shape.radius_m * shape.radius_m / 5,) * 3, UNTURNED
    inertia = inertia_of(body)
    return body.center_m, inertia.moments_kg_m2, inertia.turn


def _write_joints(mujoco: ModuleType, structure: Structure, model: Any, data: Any, world: World) -> None:
    joints, dofs = world.joints, structure.dofs
    model.opt.disableflags = structure.model.opt.disableflags | _unused(mujoco, world)
    model.dof_frictionloss[dofs] = [joint.dry_friction + joint.static_friction for joint in joints]
    model.jnt_limited[structure.joints] = [joint.limits is not None for joint in joints]
    model.jnt_range[structure.joints] = [joint.limits or (0.0, 0.0) for joint in joints] or np.empty((0, 2))
    model.dof_armature[dofs] = [joint.armature for joint in joints]
    mujoco.mj_setConst(model, data)
    servos, motors = _servos(structure, model, world), _motors(mujoco, structure, model, data, world)
    rotors = [(each.dof, each.rotor_kg_m2) for each in servos] + [(each.dof, each.rotor_kg_m2) for each in motors]
    for dof, rotor in rotors:
        model.dof_armature[dof] += rotor
    dampers = [(dof, joint.damping) for joint, dof in zip(joints, dofs.tolist(), strict=True) if joint.damping]
    for dof, damping in dampers:
        model.dof_armature[dof] += world.time_step_s * damping  # the speed after the step is damped, not that before
    mujoco.mj_setConst(model, data)
    rubbing = np.flatnonzero(model.dof_frictionloss).tolist()  # MuJoCo's rows of friction are in this order
    stickers = [
        (rubbing.index(dof), joint.dry_friction, joint.static_friction, joint.stribeck_speed)
        for joint, dof in zip(joints, dofs.tolist(), strict=True)
        if joint.static_friction
    ]
    known = settings(world, model.nv, servos, motors, dampers, stickers)
    model.numeric_data[: len(known)] = known


def _unused(mujoco: ModuleType, world: World) -> int:
    """Return the flags of rows that a world has none of: MuJoCo then does not look for them."""
    flags = mujoco.mjtDisableBit
    no_limits = all(joint.limits is None for joint in world.joints)
    no_friction = not any(joint.dry_friction or joint.static_friction for joint in world.joints)
    return no_limits * int(flags.mjDSBL_LIMIT) | no_friction * int(flags.mjDSBL_FRICTIONLOSS)


def _servos(structure: Structure, model: Any, world: World) -> list[Servo]:
    """Return the settings of Motors that have any strength."""
    return [
        Servo(dof, motor.position_gain, motor.max_speed_rad_s, motor.max_torque_nm, ROTOR * float(model.dof_M0[dof]))
        for motor, dof in _motors_at(structure, world)
        if isinstance(motor, Motor) and motor.max_torque_nm > 0
    ]


def _motors(mujoco: ModuleType, structure: Structure, model: Any, data: Any, world: World) -> list[PD]:
    """Return the settings of PDMotors, and of Motors without strength, which give no torque."""
    motors = _motors_at(structure, world)
    driven = any(isinstance(motor, PDMotor) for motor, _ in motors)
    inverses = _inverse_inertias(mujoco, structure, model, data, world) if driven else []
    return [
        _pd(motor, dof, inverses[dof], world.time_step_s) if isinstance(motor, PDMotor) else PD(dof, PDLaw(), 0.0)
        for motor, dof in motors
        if isinstance(motor, PDMotor) or motor.max_torque_nm <= 0
    ]


def _motors_at(structure: Structure, world: World) -> list[tuple[Motor | PDMotor, int]]:
    """Return the motors with their degrees of freedom."""
    pairs = zip(world.joints, structure.dofs.tolist(), strict=True)
    return [(joint.motor, dof) for joint, dof in pairs if joint.motor is not None]


def _pd(motor: PDMotor, dof: int, inverse: float, step_s: float) -> PD:
    """Return the settings of a motor.

    The law of the core is that of a joint without a rotor. One with the rotor moves alike, and also in contact, or
    under a load. A rotor is no heavier than a servo's, for it delays a torque at its limit.
    """
    law = pd_law(motor, inverse, step_s)
    gains = {"position": motor.kd + step_s * motor.kp, "velocity": motor.kd, "torque": 0.0}
    rotor = min(step_s * gains[motor.follows], ROTOR / inverse)
    more = 1.0 + rotor * inverse
    return PD(dof, PDLaw(more * law.stiffness, more * law.damping, more * law.feed, law.strongest_nm), rotor)


def _inverse_inertias(mujoco: ModuleType, structure: Structure, model: Any, data: Any, world: World) -> list[float]:
    """Return `(d,)`: acceleration of each degree of freedom by force at the start, all others free."""
    data.qpos[:] = start(structure, world)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_crb(model, data)
    mujoco.mj_factorM(model, data)
    accelerations = np.empty((model.nv, model.nv))
    mujoco.mj_solveM(model, data, accelerations, np.eye(model.nv))
    return [float(each) for each in np.diag(accelerations)]
