"""The numbers of a World in a MuJoCo model: masses, inertias, joints, motors, materials and gravity.

All of a group is written from the world alone, so a model that had another world is the same to the bit.
"""

from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.inertias import inertia_of
from gaplab.services.core.motor_law import PDLaw, pd_law
from gaplab.services.core.observations import gravity_m_s2
from gaplab.services.core.shapes import UNTURNED, Box, Quaternion, Sphere, Vector
from gaplab.services.core.world import Body, Material, Motor, PDMotor, World
from gaplab.services.engines.mujoco.model import Structure, scalar_first
from gaplab.services.engines.mujoco.settings import FALL, PD, Servo, settings

ROTOR = 8.0
"""Inertia of a servo's rotor, relative to that of what its joint carries in the zero pose: in one step a free limb
reaches eight ninths of the target speed. The rank correlation with PyBullet over random gaits was 0.78; with 2, 4, 16
and 32 it was 0.41, 0.72, 0.66 and 0.57."""

IN_PLACE, SAME_TURN, ANYWHERE = 1, 3, 0
"""MuJoCo's values of `sameframe`: frames are equal, only their turns are, or neither."""


def write(mujoco: ModuleType, structure: Structure, model: Any, data: Any, world: World, before: World | None) -> None:
    """Write a world into a copy of its structure's model.

    Args:
        mujoco: the library module.
        structure: structure.
        model: copy of its model.
        data: data for computations.
        world: world to write.
        before: world that the model has; None if none has been written.
    """
    other_bodies = before is None or world.bodies is not before.bodies
    if other_bodies:
        _write_bodies(structure, model, world)
    if other_bodies or before is None or world.joints is not before.joints:
        _write_joints(mujoco, structure, model, data, world)
    if before is None or (world.slope_rad, world.gravity_m_s2) != (before.slope_rad, before.gravity_m_s2):
        model.numeric_data[FALL] = abs(world.gravity_m_s2) * world.time_step_s
        model.opt.gravity[:] = gravity_m_s2(world)
    paint(structure, model, world)


def paint(structure: Structure, model: Any, world: World) -> None:
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
    model.dof_frictionloss[dofs] = [joint.dry_friction for joint in joints]
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
    known = settings(world, model.nv, structure.ahead, servos, motors, dampers)
    model.numeric_data[: len(known)] = known


def _unused(mujoco: ModuleType, world: World) -> int:
    """Return the flags of rows that a world has none of: MuJoCo then does not look for them."""
    flags = mujoco.mjtDisableBit
    no_limits = all(joint.limits is None for joint in world.joints)
    no_friction = not any(joint.dry_friction for joint in world.joints)
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
