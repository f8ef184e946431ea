"""A World's bodies, hinges and motors as a PhysX articulation, in reduced coordinates."""

from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import Any, TypeAlias

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.world import Body, Box, Joint, Motor, Vector, World

Handle: TypeAlias = Any
"""Something that SAPIEN made: its types cannot be named where the library must not be imported."""

ROBOT_GROUPS = [1, 0, 0, 0]
"""Bodies meet the ground, whose groups are SAPIEN's default, and not each other: a shape's first group must share a bit
with the other's second."""

CONTACT_OFFSET_M = 0.01
"""Surfaces nearer than this are looked at as possible contacts; they touch at distance 0."""

UNLIMITED = 1e6
"""In m/s and rad/s: PhysX's defaults, 10 m/s and 50 rad/s for a link, would brake what World does not brake."""

RIGIDITY = 1e4
"""How much more a motor's target speed counts than the speed that the joint has: see `_drive`."""

LARGEST_GAIN = 0.999
"""A motor that closes all of the error in a step would be infinitely stiff."""

MOST_ITERATIONS = 255
"""PhysX keeps their number in a byte."""


@dataclass(frozen=True)
class PhysXRobot:
    """A World's robot in PhysX.

    Attributes:
        links: the bodies, by name, the base first.
        entities: what carries them, to be added to a scene in this order.
        articulation: all of them together.
        motors: the joints that are actuators, in the World's order.
    """

    links: dict[str, Handle]
    entities: tuple[Handle, ...]
    articulation: Handle
    motors: tuple[Handle, ...]


def build_robot(sapien: ModuleType, world: World, material: Handle) -> PhysXRobot:
    """The robot of the world at its start, its surfaces of the one material, not yet in a scene."""
    bodies = {body.name: body for body in world.bodies}
    base = world.bodies[0]
    links = {base.name: _link(sapien, base, None, material)}
    for joint in _outwards(world):
        links[joint.child] = _link(sapien, bodies[joint.child], links[joint.parent], material)
        _hinge(sapien, links[joint.child].joint, joint, world.time_step_s)
    entities = tuple(sapien.Entity().add_component(link) for link in links.values())
    entities[0].pose = sapien.Pose([0.0, 0.0, world.start_height_m])
    articulation = links[base.name].articulation
    articulation.solver_position_iterations = min(world.solver_iterations, MOST_ITERATIONS)
    articulation.solver_velocity_iterations = 1  # takes out the speed that pushing bodies apart has added
    articulation.sleep_threshold = 0.0
    return PhysXRobot(links, entities, articulation, tuple(links[joint.child].joint for joint in world.actuators))


def _outwards(world: World) -> Iterator[Joint]:
    """The joints, each after the one that carries its parent."""
    reached = [world.bodies[0].name]
    for name in reached:
        for joint in world.joints:
            if joint.parent == name:
                reached.append(joint.child)
                yield joint


def _link(sapien: ModuleType, body: Body, parent: Handle | None, material: Handle) -> Handle:
    """A body with the inertia of its solid shape, and nothing that slows it but contacts."""
    link = sapien.physx.PhysxArticulationLinkComponent(parent)
    center = sapien.Pose(body.center_m)
    if body.collides:
        shape = _shape(sapien, body, material)
        shape.local_pose = center
        set_offsets(shape)
        shape.set_collision_groups(ROBOT_GROUPS)
        link.attach(shape)
    link.mass = body.mass_kg
    link.inertia = _inertia(body)
    link.cmass_local_pose = center
    link.linear_damping = link.angular_damping = 0.0
    link.max_linear_velocity = link.max_angular_velocity = UNLIMITED
    return link


def _shape(sapien: ModuleType, body: Body, material: Handle) -> Handle:
    if isinstance(body.shape, Box):
        return sapien.physx.PhysxCollisionShapeBox([edge / 2 for edge in body.shape.size_m], material)
    return sapien.physx.PhysxCollisionShapeSphere(body.shape.radius_m, material)


def set_offsets(shape: Handle) -> None:
    """Where a shape touches, whatever this process made SAPIEN's default."""
    shape.contact_offset = CONTACT_OFFSET_M
    shape.rest_offset = 0.0


def _inertia(body: Body) -> FloatArray:
    """`(3,)`: principal moments of inertia of even density, kg m²."""
    if isinstance(body.shape, Box):
        squares = np.square(body.shape.size_m)
        return np.asarray(body.mass_kg / 12 * (squares.sum() - squares))
    return np.full(3, 0.4 * body.mass_kg * body.shape.radius_m**2)


def _hinge(sapien: ModuleType, hinge: Handle, joint: Joint, time_step_s: float) -> None:
    """A joint without limits or friction; PhysX's hinges turn about their own x."""
    turn = _turn_from_x(joint.axis)
    hinge.type = "revolute_unwrapped"
    hinge.pose_in_parent = sapien.Pose(joint.origin_m, turn)
    hinge.pose_in_child = sapien.Pose([0.0, 0.0, 0.0], turn)
    hinge.limit = [[-np.inf, np.inf]]
    hinge.friction = 0.0
    hinge.max_velocity = UNLIMITED
    if joint.motor is not None:
        _drive(hinge, joint.motor, time_step_s)


def _turn_from_x(axis: Vector) -> FloatArray:
    """`(4,)`: the shortest turn from the x axis to a unit vector, as a quaternion w, x, y, z."""
    if axis[0] < -0.999999:
        return np.array([0.0, 0.0, 0.0, 1.0])
    turn = np.array([1.0 + axis[0], 0.0, -axis[2], axis[1]])
    return np.asarray(turn / np.linalg.norm(turn))


def _drive(hinge: Handle, motor: Motor, time_step_s: float) -> None:
    """World's motor as a PhysX drive, a spring k with a damper d.

    A drive in acceleration mode is solved implicitly and apart from the inertia that it moves: from speed v and error
    e, a step h leads to v' = (v + h k e) / (1 + h d + h² k). With d = R/h and k = g (1 + R) / (1 - g) / h² that is
    v' = g e/h + v (1 - g) / (1 + R): for a large R, World's velocity constraint, which closes the share g of the error
    in each step. The drive's greatest force is the motor's torque; the greatest speed is the joint's, whatever
    turns it.
    """
    gain = min(motor.position_gain, LARGEST_GAIN)
    stiffness = gain * (1 + RIGIDITY) / (1 - gain) / time_step_s**2
    hinge.set_drive_properties(stiffness, RIGIDITY / time_step_s, motor.max_torque_nm, "acceleration")
    hinge.max_velocity = motor.max_speed_rad_s
