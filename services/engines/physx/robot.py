"""A World's bodies, hinges and motors as a PhysX articulation, in reduced coordinates."""

from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import Any, TypeAlias

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.shapes import Box, Vector
from gaplab.services.core.world import Body, Joint, Motor, World

Handle: TypeAlias = Any
"""An object of SAPIEN, untyped because the library must not be imported here."""

ROBOT_GROUPS = [1, 0, 0, 0]
"""Collision groups: bodies collide with the ground, which has SAPIEN's default groups, but not with each other. Two
shapes collide if the first group of one shares a bit with the second group of the other."""

CONTACT_OFFSET_M = 0.01
"""Distance below which surfaces are candidates for contact; they touch at distance 0."""

UNLIMITED = 1e6
"""Speed limit of links, m/s and rad/s: PhysX's defaults, 10 m/s and 50 rad/s, would brake permitted motions."""

RIGIDITY = 1e4
"""Weight of a motor's target speed relative to the current speed of the joint: see `_drive`."""

LARGEST_GAIN = 0.999
"""Largest gain: a motor that closes the whole error in a step would be infinitely stiff."""

MOST_ITERATIONS = 255
"""Largest number of iterations: PhysX stores it in a byte."""


@dataclass(frozen=True)
class PhysXRobot:
    """A World's robot in PhysX.

    Attributes:
        links: bodies by name, the base first.
        entities: entities of the bodies, to add to a scene in this order.
        articulation: the articulation of all bodies.
        motors: joints with actuators, in the World's order.
    """

    links: dict[str, Handle]
    entities: tuple[Handle, ...]
    articulation: Handle
    motors: tuple[Handle, ...]


def build_robot(sapien: ModuleType, world: World, material: Handle) -> PhysXRobot:
    """Build the robot of a world at its start, with one material, without adding it to a scene."""
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
    articulation.solver_velocity_iterations = 1  # removes the speed that separating overlapping bodies adds
    articulation.sleep_threshold = 0.0
    return PhysXRobot(links, entities, articulation, tuple(links[joint.child].joint for joint in world.actuators))


def _outwards(world: World) -> Iterator[Joint]:
    """Return the joints in order from the base outwards."""
    reached = [world.bodies[0].name]
    for name in reached:
        for joint in world.joints:
            if joint.parent == name:
                reached.append(joint.child)
                yield joint


def _link(sapien: ModuleType, body: Body, parent: Handle | None, material: Handle) -> Handle:
    """Create a link with the inertia of its solid shape, slowed only by contacts."""
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
    """Set the contact distances of a shape, overriding SAPIEN's process-wide defaults."""
    shape.contact_offset = CONTACT_OFFSET_M
    shape.rest_offset = 0.0


def _inertia(body: Body) -> FloatArray:
    """Return `(3,)`: principal moments of inertia at uniform density, kg m²."""
    if isinstance(body.shape, Box):
        squares = np.square(body.shape.size_m)
        return np.asarray(body.mass_kg / 12 * (squares.sum() - squares))
    return np.full(3, 0.4 * body.mass_kg * body.shape.radius_m**2)


def _hinge(sapien: ModuleType, hinge: Handle, joint: Joint, time_step_s: float) -> None:
    """Configure a hinge without limits or friction; PhysX's hinges turn about their own x."""
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
    """Return `(4,)`: the shortest rotation from the x axis to a unit vector, as a quaternion w, x, y, z."""
    if axis[0] < -0.999999:
        return np.array([0.0, 0.0, 0.0, 1.0])
    turn = np.array([1.0 + axis[0], 0.0, -axis[2], axis[1]])
    return np.asarray(turn / np.linalg.norm(turn))


def _drive(hinge: Handle, motor: Motor, time_step_s: float) -> None:
    """Configure a World's motor as a PhysX drive, a spring k with a damper d.

    A drive in acceleration mode is solved implicitly and independently of inertia: from speed v and error e, a step h
    leads to v' = (v + h k e) / (1 + h d + h² k). With d = R/h and k = g (1 + R) / (1 - g) / h² that is
    v' = g e/h + v (1 - g) / (1 + R): for a large R, this is World's velocity constraint, which closes the share g of
    the error in each step. The largest force of the drive is the motor's torque. The largest speed applies to the
    joint, whatever turns it.
    """
    gain = min(motor.position_gain, LARGEST_GAIN)
    stiffness = gain * (1 + RIGIDITY) / (1 - gain) / time_step_s**2
    hinge.set_drive_properties(stiffness, RIGIDITY / time_step_s, motor.max_torque_nm, "acceleration")
    hinge.max_velocity = motor.max_speed_rad_s
