"""Shapes of a World's bodies as PhysX's, each with its place, its material and the ground that it touches."""

from types import ModuleType
from typing import Any, TypeAlias

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.kinematics import product
from gaplab.services.core.shapes import UNTURNED, Box, Capsule, Cylinder, Hull, Part, Quaternion, Shape, Sphere, Vector

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
