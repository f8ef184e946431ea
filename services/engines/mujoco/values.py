"""The numbers of a World in a MuJoCo model: masses, inertias, joints, motors, materials and gravity.

All of a group is written from the world alone, so a model that had another world is the same to the bit.
"""

from functools import lru_cache
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.motor_law import pd_law
from gaplab.services.core.observations import gravity_m_s2
from gaplab.services.core.shapes import Box, Shape, Sphere
from gaplab.services.core.world import Body, Material, Motor, PDMotor, World
from gaplab.services.engines.mujoco.model import FREE_POSITIONS, Structure, compiled_inertia, scalar_first
from gaplab.services.engines.mujoco.settings import Servo, Settings, settings

ROTOR = 8.0
"""Inertia of a servo's rotor, relative to that of what its joint carries in the zero pose: in one step a free limb
reaches eight ninths of the target speed. docs/engines.md has results for other values."""

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
    if before is None or world.bodies is not before.bodies or world.joints is not before.joints:
        _write_bodies(structure, model, world)
        _write_joints(mujoco, structure, model, data, world)
    if before is None or world.slope_rad != before.slope_rad:
        model.opt.gravity[:] = gravity_m_s2(world)
    paint(structure, model, world)


def paint(structure: Structure, model: Any, world: World) -> None:
    """Write materials into the pairs of a model, where the law reads them."""
    if not world.surfaces:
        model.pair_friction[:] = _coefficients(world.material)
        return
    for pair, body in enumerate(structure.pairs):
        model.pair_friction[pair] = _coefficients(world.material_of(world.bodies[body]))


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
    for body, at in zip(world.bodies, structure.bodies, strict=True):
        center, moments, turn = inertial(body)
        model.body_mass[at], model.body_inertia[at] = body.mass_kg, moments
        model.body_ipos[at], model.body_iquat[at] = center, turn
        model.body_sameframe[at] = _sameframe(center, turn)
    for at, geom, offset in structure.solids:
        place = np.array(world.bodies[at].center_m) + offset
        model.geom_pos[geom] = place
        model.geom_sameframe[geom] = _sameframe(place, model.geom_quat[geom])


def _sameframe(place: Any, turn: Any) -> int:
    if tuple(turn) != (1.0, 0.0, 0.0, 0.0):
        return ANYWHERE
    return SAME_TURN if any(place) else IN_PLACE


def inertial(body: Body) -> tuple[Any, Any, Any]:
    """Return center, principal moments, and their turn as w, x, y, z."""
    if body.inertia is not None:
        return body.center_m, body.inertia.moments_kg_m2, scalar_first(body.inertia.turn)
    assert not isinstance(body.shape, tuple)
    match body.shape:
        case Box():
            x, y, z = (edge / 2 * (edge / 2) for edge in body.shape.size_m)
            return body.center_m, [body.mass_kg * each / 3 for each in (y + z, x + z, x + y)], (1.0, 0.0, 0.0, 0.0)
        case Sphere():
            moment = 2 * body.mass_kg * body.shape.radius_m * body.shape.radius_m / 5
            return body.center_m, [moment] * 3, (1.0, 0.0, 0.0, 0.0)
        case _:
            center, moments, turn = _unit_inertia(body.shape)
            return center + np.array(body.center_m), body.mass_kg * moments, turn


@lru_cache(maxsize=256)
def _unit_inertia(shape: Shape) -> tuple[FloatArray, FloatArray, FloatArray]:
    return compiled_inertia(import_module("mujoco"), shape)


def _write_joints(mujoco: ModuleType, structure: Structure, model: Any, data: Any, world: World) -> None:
    joints, dofs = world.joints, structure.dofs
    model.dof_frictionloss[dofs] = [joint.dry_friction for joint in joints]
    model.jnt_limited[structure.joints] = [joint.limits is not None for joint in joints]
    model.jnt_range[structure.joints] = [joint.limits or (0.0, 0.0) for joint in joints] or np.empty((0, 2))
    model.dof_armature[dofs] = [joint.armature for joint in joints]
    mujoco.mj_setConst(model, data)
    servos = []
    for joint, dof in zip(joints, dofs.tolist(), strict=True):
        if isinstance(joint.motor, Motor) and joint.motor.max_torque_nm > 0:
            rotor, motor = ROTOR * float(model.dof_M0[dof]), joint.motor
            model.dof_armature[dof] += rotor
            servos.append(Servo(dof, motor.position_gain, motor.max_speed_rad_s, motor.max_torque_nm, rotor))
    motors = _motors(mujoco, structure, model, data, world)
    dampers = [(dof, joint.damping) for joint, dof in zip(joints, dofs.tolist(), strict=True) if joint.damping]
    for dof, damping in dampers:
        model.dof_armature[dof] += world.time_step_s * damping  # the speed after the step is damped, not that before
    mujoco.mj_setConst(model, data)
    known = settings(world, model.nv, structure.ahead, Settings(servos, motors, dampers))
    model.numeric_data[: len(known)] = known


def _motors(mujoco: ModuleType, structure: Structure, model: Any, data: Any, world: World) -> list[Any]:
    """Return the degrees of freedom and the laws of PD motors, and of motors without strength, which give no torque."""
    found: list[Any] = []
    weak = PDMotor("torque", 0.0)
    motors = [(joint.motor, dof) for joint, dof in zip(world.joints, structure.dofs.tolist(), strict=True)]
    if any(isinstance(motor, PDMotor) for motor, _ in motors):
        inverses = _inverse_inertias(mujoco, structure, model, data, world)
    for motor, dof in motors:
        if isinstance(motor, PDMotor):
            found.append((dof, pd_law(motor, inverses[dof], world.time_step_s)))
        elif motor is not None and motor.max_torque_nm <= 0:
            found.append((dof, pd_law(weak, 0.0, world.time_step_s)))
    return found


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
