"""A World as a MuJoCo model: compiled once, and edited for each material."""

from collections.abc import Iterator
from types import ModuleType
from typing import Any

import numpy as np

from gaplab.services.core.shapes import Box
from gaplab.services.core.world import Body, Joint, Material, World
from gaplab.services.engines.mujoco.law import EACH, FIRST, Drive

GROUND = "the ground"

RIGID = (0.9999, 0.9999, 1.0, 0.5, 1.0)
"""Impedance of a contact: almost rigid, at any depth."""

UNUSED = (-1.0, -1.0)
"""Spring and damper in MuJoCo's direct format, which the law does not use."""

ROTOR = 8.0
"""Inertia of a motor's rotor, relative to that of the bodies that its hinge carries in the zero pose: in one step a
free limb reaches eight ninths of the target speed. docs/engines.md has results for other values."""

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
    "mjDSBL_FRICTIONLOSS",
    "mjDSBL_LIMIT",
    "mjDSBL_EQUALITY",
)
"""Features of MuJoCo that a World does not need."""


def compiled(mujoco: ModuleType, world: World) -> Any:
    """Compile the model of a world, in any material."""
    spec = mujoco.MjSpec()
    _set_up_physics(mujoco, spec, world)
    spec.worldbody.add_geom(name=GROUND, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], contype=0, conaffinity=0)
    _add_bodies(mujoco, spec, world)
    for body in world.bodies:
        if body.collides:
            _let_collide(spec, body)
    model = spec.compile()
    for joint in driven(world):
        model.dof_armature[_dof(model, joint)] = ROTOR * model.dof_M0[_dof(model, joint)]
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def driven(world: World) -> list[Joint]:
    """Return the joints whose motors have any strength."""
    return [joint for joint in world.actuators if joint.motor is not None and joint.motor.max_torque_nm > 0]


def drives(model: Any, world: World) -> list[Drive]:
    """Return the settings of a world's motors for the law, in the order of its actuators."""
    found = []
    for joint in driven(world):
        assert joint.motor is not None
        dof, motor = _dof(model, joint), joint.motor
        rotor = float(model.dof_armature[dof])
        found.append(Drive(dof, motor.position_gain, motor.max_speed_rad_s, motor.max_torque_nm, rotor))
    return found


def paint(model: Any, material: Material) -> None:
    """Write a material into all contact pairs of a model, where the law reads it."""
    dynamic = material.dynamic_friction
    static = max(material.static_friction, dynamic)
    model.pair_friction[:] = (static, static, dynamic, material.restitution, 0.0)  # STATIC, twice, DYNAMIC, RESTITUTION


def _dof(model: Any, joint: Joint) -> int:
    return int(model.joint(joint.name).dofadr[0])


def _set_up_physics(mujoco: ModuleType, spec: Any, world: World) -> None:
    option = spec.option
    option.timestep = world.time_step_s
    option.gravity = [0.0, 0.0, -world.gravity_m_s2]
    option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    option.solver = mujoco.mjtSolver.mjSOL_PGS  # unused, but it makes MuJoCo compute the inverse inertia at contacts
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    option.disableflags = sum(int(getattr(mujoco.mjtDisableBit, each)) for each in SWITCHED_OFF)
    spec.nuserdata = FIRST + EACH * len(world.joints)


def _add_bodies(mujoco: ModuleType, spec: Any, world: World) -> None:
    bodies = {body.name: body for body in world.bodies}
    base = world.bodies[0]
    made = {base.name: spec.worldbody.add_body(name=base.name, pos=[0.0, 0.0, world.start_height_m])}
    made[base.name].add_freejoint()
    _add_shape(mujoco, made[base.name], base)
    for joint in _depth_first(world, base.name):
        made[joint.child] = made[joint.parent].add_body(name=joint.child, pos=joint.origin_m)
        made[joint.child].add_joint(name=joint.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=joint.axis)
        _add_shape(mujoco, made[joint.child], bodies[joint.child])


def _add_shape(mujoco: ModuleType, made: Any, body: Body) -> None:
    """Add a shape with inertia of uniform density, which collides only in declared pairs."""
    if isinstance(body.shape, Box):
        kind, size = mujoco.mjtGeom.mjGEOM_BOX, [edge / 2 for edge in body.shape.size_m]
    else:
        kind, size = mujoco.mjtGeom.mjGEOM_SPHERE, [body.shape.radius_m, 0.0, 0.0]
    made.add_geom(name=body.name, type=kind, size=size, pos=body.center_m, mass=body.mass_kg, contype=0, conaffinity=0)


def _let_collide(spec: Any, body: Body) -> None:
    """Declare contacts with the ground, with friction in two directions."""
    spec.add_pair(
        geomname1=GROUND,
        geomname2=body.name,
        condim=3,
        friction=np.ones(5),
        solref=UNUSED,
        solreffriction=UNUSED,
        solimp=RIGID,
    )


def _depth_first(world: World, parent: str) -> Iterator[Joint]:
    for joint in world.joints:
        if joint.parent == parent:
            yield joint
            yield from _depth_first(world, joint.child)
