"""A world as a file for MuJoCo alone, without the law of this engine, and the motions that it has there.

MuJoCo's own contacts have one friction and no restitution: the file has each body's dynamic friction. Servos are stiff
PD motors there.
"""

from collections.abc import Mapping, Sequence
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import InvalidRobot
from gaplab.services.engines.mujoco.engine import MuJoCo
from gaplab.services.engines.mujoco.model import GROUND, ROTOR, add_bodies, add_geom, inertial, named, scalar_first
from gaplab.services.engines.mujoco.pool import unlogged
from gaplab.services.world.kinematics import outwards
from gaplab.services.world.motions import Motion
from gaplab.services.world.sensing import gravity_m_s2
from gaplab.services.world.world import Motor, PDMotor, World

LOST = (
    "material.static_friction",
    "material.restitution",
    "static_friction",
    "stribeck_speed",
    "motor.delay_s",
    "noise.",
    "time_offset_s",
    "biases",
)
"""How names of values begin that the file has no place for."""

SPINNING_ROLLING = (0.005, 0.0001)
"""MuJoCo's own frictions of spinning and rolling, which these contacts do not use."""


def mjcf_of(world: World, comments: Sequence[str] = ()) -> str:
    """Return a world with bodies as MJCF, after comments; the control of an actuator is the target of its motor.

    Raises:
        InvalidRobot: MuJoCo is not installed, or refuses the world.
    """
    if not MuJoCo.available():
        raise InvalidRobot([f"MuJoCo writes this file: {MuJoCo.install}"])
    mujoco = import_module("mujoco")
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = world.time_step_s, gravity_m_s2(world)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.compiler.autolimits = spec.compiler.degree = False
    spec.worldbody.add_geom(name=GROUND, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], pos=[0, 0, world.ground_m])
    _complete(mujoco, spec, add_bodies(mujoco, spec, world, _called), world)
    try:
        model = spec.compile()
        names = [world.joints[number].name for number in outwards(world)]
        inertias = dict(zip(names, model.dof_M0[model.nv - len(names) :], strict=True))
        for joint in world.actuators:
            if joint.motor is not None:
                _add_motor(mujoco, spec, spec.joint(joint.name), joint.motor, inertias[joint.name], world.time_step_s)
        spec.compile()
    except ValueError as error:
        raise InvalidRobot([f"MuJoCo alone refuses this world: {error}"]) from error
    told = "\n".join(f"  {line.replace('--', '- -')}" for line in comments)
    return f"<!--\n{told}\n-->\n{spec.to_xml()}" if told else str(spec.to_xml())


def plain_positions(world: World, motion: Motion) -> FloatArray:
    """Return `(t, 3)`: positions of a motion's observed body in MuJoCo with its own contacts and motors, m."""
    mujoco = import_module("mujoco")
    model = mujoco.MjModel.from_xml_string(mjcf_of(world))
    data = mujoco.MjData(model)
    for joint in world.joints:
        data.joint(joint.name).qpos = joint.start
    observed, step_s = _called(world.observed or world.bodies[0].name), world.time_step_s
    steps, commands = (np.rint(each / step_s).astype(int) for each in (motion.observe_s, motion.times_s))
    found = np.empty((len(steps), 3))
    with unlogged(mujoco):
        for step in range(steps[-1] + 1):
            if len(here := np.flatnonzero(steps == step)):
                mujoco.mj_kinematics(model, data)
                found[here] = data.body(observed).xpos
            data.ctrl[:] = motion.targets[np.searchsorted(commands, step, side="right") - 1]
            mujoco.mj_step(model, data)
    return found


def _called(body: str) -> str:
    """Return the name of a body in the file, where MuJoCo's ground is the body "world"."""
    return named(body) if body == "world" else body


def _complete(mujoco: ModuleType, spec: Any, made: Mapping[str, Any], world: World) -> None:
    """Give joints and bodies all that a world says of them, and bodies their shapes."""
    for ours in world.joints:
        joint = spec.joint(ours.name)
        joint.limited, joint.range = ours.limits is not None, ours.limits or (0.0, 0.0)
        joint.damping, joint.frictionloss, joint.armature = [ours.damping, 0.0, 0.0], ours.dry_friction, ours.armature
    surfaces = dict(world.surfaces)
    for each in world.bodies:
        body = made[each.name]
        body.ipos, body.inertia, axes = inertial(each)
        body.mass, body.iquat, body.explicitinertial = each.mass_kg, scalar_first(axes), True
        friction = surfaces.get(each.surface, world.material).dynamic_friction
        for number, part in enumerate(each.parts):
            geom = add_geom(mujoco, spec, body, f"{each.name}/{number}", part)
            geom.priority, geom.friction, geom.conaffinity = 1, (friction, *SPINNING_ROLLING), int(part.collides)


def _add_motor(
    mujoco: ModuleType, spec: Any, joint: Any, motor: Motor | PDMotor, inertia: float, step_s: float
) -> None:
    """Add a motor; a servo closes its share of the error in a step, as far as its rotor's inertia permits."""
    if isinstance(motor, PDMotor):
        kp, kd = motor.kp, motor.kd
        gain, kp, kd = {"position": (kp, kp, kd), "velocity": (kd, 0.0, kd), "torque": (1.0, 0.0, 0.0)}[motor.follows]
    else:
        kd = ROTOR * inertia / step_s
        joint.armature += ROTOR * inertia
        gain = kp = motor.position_gain * kd / step_s
    spec.add_actuator(
        name=joint.name,
        target=joint.name,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        gainprm=[gain, *[0.0] * 9],
        biasprm=[0.0, -kp, -kd, *[0.0] * 7],
        forcelimited=True,
        forcerange=(-motor.max_torque_nm, motor.max_torque_nm),
    )
