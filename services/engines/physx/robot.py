"""A World's bodies, shapes and joints as a PhysX articulation, in reduced coordinates."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any, TypeAlias

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.world.inertias import inertia_of
from gaplab.services.world.kinematics import product
from gaplab.services.world.world import (
    UNTURNED,
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Joint,
    Part,
    Quaternion,
    Shape,
    Sphere,
    Vector,
    World,
)

Handle: TypeAlias = Any
"""An object of SAPIEN, untyped because the library must not be imported here."""

CONTACT_OFFSET_M = 0.01
"""Distance below which surfaces are candidates for contact; they touch at distance 0."""

MOST_SURFACES = 31
"""Largest number of surfaces that have a ground of their own: one bit of PhysX's collision groups each."""

Z = (0.0, 0.0, 1.0)


def build_shape(sapien: ModuleType, part: Part, material: Handle, surface: int) -> Handle:
    """Return a shape at its place on a body.

    Args:
        sapien: the library module.
        part: shape and place.
        material: material of its contacts.
        surface: number of the ground that it touches: see `robot_groups`.
    """
    lies = isinstance(part.shape, Capsule | Cylinder)  # along x, in PhysX
    turn = turn_from_x(Z) if lies else np.array(UNTURNED)
    place = product(np.array(part.turn), turn) if part.turn != UNTURNED else turn
    shape = _geometry(sapien, part.shape, material)
    shape.local_pose = pose_of(sapien, part.center_m, place)
    set_offsets(shape)
    shape.set_collision_groups(robot_groups(surface))
    return shape


def _geometry(sapien: ModuleType, shape: Shape, material: Handle) -> Handle:
    """Return PhysX's shape; a cylinder is a prism of SAPIEN's."""
    physx = sapien.physx
    match shape:
        case Box(size_m=edges):
            return physx.PhysxCollisionShapeBox([edge / 2 for edge in edges], material)
        case Sphere(radius_m=radius):
            return physx.PhysxCollisionShapeSphere(radius, material)
        case Capsule(radius_m=radius, length_m=length):
            return physx.PhysxCollisionShapeCapsule(radius, length / 2, material)
        case Cylinder(radius_m=radius, length_m=length):
            return physx.PhysxCollisionShapeCylinder(radius, length / 2, material)
        case Hull(points_m=points):
            vertices, scale = np.array(points, np.float32), np.ones(3, np.float32)
            return physx.PhysxCollisionShapeConvexMesh(vertices=vertices, scale=scale, material=material)


def pose_of(sapien: ModuleType, position: Vector, turn: FloatArray | Quaternion) -> Handle:
    """Return SAPIEN's pose, whose quaternions are w, x, y, z, of a position and a rotation x, y, z, w."""
    x, y, z, w = turn
    return sapien.Pose(position, [w, x, y, z])


def set_offsets(shape: Handle) -> None:
    """Set the contact distances of a shape, overriding SAPIEN's process-wide defaults."""
    shape.contact_offset = CONTACT_OFFSET_M
    shape.rest_offset = 0.0


def robot_groups(surface: int) -> list[int]:
    """Return the collision groups of a shape on the robot, which touches the ground of its surface and nothing else.

    Two shapes collide if the first group of one shares a bit with the second group of the other.

    Args:
        surface: 0 for the ground's own material, else the number of the surface.
    """
    return [1 << surface, 0, 0, 0]


def ground_groups(surface: int) -> list[int]:
    """Return the collision groups of the ground of a surface; those of surface 0 are SAPIEN's defaults."""
    return [1, 1, 0, 0] if surface == 0 else [0, 1 << surface, 0, 0]


def turn_from_x(axis: Vector) -> FloatArray:
    """Return `(4,)`: the shortest rotation from the x axis to a unit vector, as a quaternion x, y, z, w."""
    if axis[0] < -0.999999:
        return np.array([0.0, 0.0, 1.0, 0.0])
    turn = np.array([0.0, -axis[2], axis[1], 1.0 + axis[0]])
    return np.asarray(turn / np.linalg.norm([turn[3], *turn[:3]]))


UNLIMITED = 1e6
"""Speed limit of links, m/s and rad/s: PhysX's defaults, 10 m/s and 50 rad/s, would brake permitted motions."""

MOST_ITERATIONS = 255
"""Largest number of iterations: PhysX stores it in a byte."""


@dataclass(frozen=True)
class PhysXRobot:
    """A World's robot in PhysX.

    Attributes:
        links: bodies by name, the base first.
        entities: entities of the bodies, to add to a scene in this order.
        articulation: the articulation of all bodies.
        joints: joints, in the World's order.
    """

    links: dict[str, Handle]
    entities: tuple[Handle, ...]
    articulation: Handle
    joints: tuple[Handle, ...]


def build_robot(sapien: ModuleType, world: World, materials: Mapping[str, Handle]) -> PhysXRobot:
    """Build the robot of a world at its start, without motors and without adding it to a scene.

    Args:
        sapien: the library module.
        world: the world.
        materials: materials by surface, in the order of their grounds; that of "" first.
    """
    bodies = {body.name: body for body in world.bodies}
    base = world.bodies[0]
    links = {base.name: _link(sapien, base, None, materials)}
    for joint in _outwards(world):
        links[joint.child] = _link(sapien, bodies[joint.child], links[joint.parent], materials)
        _connect(sapien, links[joint.child].joint, joint)
    if world.fixed:
        links[base.name].joint.type = "fixed"
    entities = tuple(sapien.Entity().add_component(link) for link in links.values())
    entities[0].pose = pose_of(sapien, (0.0, 0.0, world.start_height_m), world.start_turn)
    articulation = links[base.name].articulation
    articulation.solver_position_iterations = min(world.solver_iterations, MOST_ITERATIONS)
    articulation.solver_velocity_iterations = 1  # removes the speed that separating overlapping bodies adds
    articulation.sleep_threshold = 0.0
    return PhysXRobot(links, entities, articulation, tuple(links[joint.child].joint for joint in world.joints))


def set_masses(link: Handle, body: Body) -> None:
    """Set mass and moments of inertia of a body; a new centre of mass would leave rounding errors in PhysX's joints."""
    link.mass = body.mass_kg
    link.inertia = np.array(inertia_of(body).moments_kg_m2)


def _outwards(world: World) -> Iterator[Joint]:
    """Return the joints in order from the base outwards."""
    reached = [world.bodies[0].name]
    for name in reached:
        for joint in world.joints:
            if joint.parent == name:
                reached.append(joint.child)
                yield joint


def _link(sapien: ModuleType, body: Body, parent: Handle | None, materials: Mapping[str, Handle]) -> Handle:
    """Create a link, slowed only by contacts."""
    link = sapien.physx.PhysxArticulationLinkComponent(parent)
    number = list(materials).index(body.surface)
    for part in body.parts:
        if part.collides:
            link.attach(build_shape(sapien, part, materials[body.surface], number))
    set_masses(link, body)
    link.cmass_local_pose = pose_of(sapien, body.center_m, inertia_of(body).turn)
    link.linear_damping = link.angular_damping = 0.0
    link.max_linear_velocity = link.max_angular_velocity = UNLIMITED
    return link


def _connect(sapien: ModuleType, handle: Handle, joint: Joint) -> None:
    """Configure a joint; PhysX's turn about their own x, or slide along it.

    PhysX's friction of joints is left out: it is a share of the force that a joint carries, not a torque.
    """
    turn = turn_from_x(joint.axis)
    handle.type = "prismatic" if joint.slides else "revolute_unwrapped"
    in_parent = turn if joint.turn == UNTURNED else product(np.array(joint.turn), turn)
    handle.pose_in_parent = pose_of(sapien, joint.origin_m, in_parent)
    handle.pose_in_child = pose_of(sapien, (0.0, 0.0, 0.0), turn)
    handle.limit = [[-np.inf, np.inf] if joint.limits is None else list(joint.limits)]
    handle.friction = 0.0
