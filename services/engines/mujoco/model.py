"""The structure of a World as a MuJoCo model, compiled once. `values` writes its numbers, for each world."""

from collections.abc import Iterator
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.shapes import Box, Capsule, Cylinder, Hull, Part, Quaternion, Sphere
from gaplab.services.core.world import Joint, World
from gaplab.services.engines.mujoco.settings import EACH_DAMPER, EACH_MOTOR, FIRST

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
        model: the compiled model.
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
    order = list(outwards(world, world.bodies[0].name))
    _add_bodies(mujoco, spec, world, order)
    geoms = [
        (at, _add_part(mujoco, spec, world.bodies[at].name, number, part))
        for at in range(int(world.fixed), len(world.bodies))  # what never moves can't collide
        for number, part in enumerate(world.bodies[at].parts)
        if part.collides
    ]
    model = spec.compile()
    return _structure(world, model, order, [(at, model.geom(name).id) for at, name in geoms])


def named(body: str) -> str:
    """Return MuJoCo's name of a body: its ground is a body too, named "world"."""
    return f"body {body}"


def scalar_first(turn: Quaternion) -> list[float]:
    """Return a quaternion x, y, z, w as MuJoCo's w, x, y, z."""
    return [turn[3], turn[0], turn[1], turn[2]]


def _scalar_last(turn: FloatArray) -> Quaternion:
    w, x, y, z = turn.tolist()
    return x, y, z, w


def _structure(world: World, model: Any, order: list[Joint], geoms: list[tuple[int, int]]) -> Structure:
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
    spec.add_numeric(name="settings", size=FIRST + (EACH_MOTOR + EACH_DAMPER) * len(world.joints))
    spec.add_sensor(
        name="accelerations",
        type=mujoco.mjtSensor.mjSENS_USER,
        dim=len(world.joints) + (0 if world.fixed else FREE_DOFS),
        needstage=mujoco.mjtStage.mjSTAGE_ACC,
        datatype=mujoco.mjtDataType.mjDATATYPE_REAL,
    )


def _add_bodies(mujoco: ModuleType, spec: Any, world: World, order: list[Joint]) -> None:
    """Add bodies and joints, with an inertia that takes any center and any turn."""
    inertia = {"mass": 1.0, "ipos": [1e-3, 0.0, 0.0], "iquat": TURNED, "inertia": [1.0] * 3, "explicitinertial": True}
    base, start = world.bodies[0].name, [0.0, 0.0, world.start_height_m]
    turn = scalar_first(world.start_turn)
    made = {base: spec.worldbody.add_body(name=named(base), pos=start, quat=turn, **inertia)}
    if not world.fixed:
        made[base].add_freejoint()
    for joint in order:
        frame = {"pos": joint.origin_m, "quat": scalar_first(joint.turn)}
        made[joint.child] = made[joint.parent].add_body(name=named(joint.child), **frame, **inertia)
        kind = mujoco.mjtJoint.mjJNT_SLIDE if joint.slides else mujoco.mjtJoint.mjJNT_HINGE
        margin = FASTEST * world.time_step_s
        made[joint.child].add_joint(name=joint.name, type=kind, axis=joint.axis, margin=margin, solimp_limit=RIGID)
        made[joint.child].joints[0].solimp_friction = RIGID


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


def outwards(world: World, parent: str) -> Iterator[Joint]:
    """Yield the joints in MuJoCo's order: depth first."""
    for joint in world.joints:
        if joint.parent == parent:
            yield joint
            yield from outwards(world, joint.child)
