"""Poses of a world's bodies, given its base and joint angles. Quaternions are x, y, z, w.

They are used as the engine returns them. scipy's `Rotation` would normalise the single precision of PhysX, which moves
bodies by 1e-8, and refuses the nan of failed physics.
"""

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.shapes import Box
from gaplab.services.core.world import Body, World

TOUCHING_M = 0.002
"""Height of the lowest point below which a body touches the ground: engines separate surfaces by less."""


def body_poses(world: World, poses: FloatArray, angles_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return positions `(k, bodies, 3)` and orientations `(k, bodies, 4)` of the bodies' frames, in the world's order.

    Args:
        world: bodies and hinges.
        poses: `(k, 7)`: poses of the base.
        angles_rad: `(k, joints)`, in the world's order.
    """
    names = [body.name for body in world.bodies]
    positions = np.empty((len(poses), len(names), 3))
    orientations = np.empty((len(poses), len(names), 4))
    positions[:, 0], orientations[:, 0] = poses[:, :3], poses[:, 3:]
    placed = {names[0]}
    while len(placed) < len(names):
        for joint, angles in zip(world.joints, angles_rad.T, strict=True):
            if joint.parent in placed and joint.child not in placed:
                parent, child = names.index(joint.parent), names.index(joint.child)
                turn = orientations[:, parent]
                positions[:, child] = positions[:, parent] + rotated(turn, np.array(joint.origin_m))
                orientations[:, child] = product(turn, about(np.array(joint.axis), angles))
                placed.add(joint.child)
    return positions, orientations


def clearances_m(body: Body, positions: FloatArray, orientations: FloatArray) -> FloatArray:
    """Return `(k,)`: the height of the lowest point of a body above the ground, negative inside it.

    Args:
        body: body with its shape.
        positions: `(k, 3)`: positions of the body's frame.
        orientations: `(k, 4)`: orientations of the body's frame.
    """
    center = positions[:, 2] + rotated(orientations, np.array(body.center_m))[:, 2]
    if isinstance(body.shape, Box):
        edges = np.diag(np.array(body.shape.size_m) / 2)
        reach = sum(np.abs(rotated(orientations, edge)[:, 2]) for edge in edges)
        return np.asarray(center - reach)
    return np.asarray(center - body.shape.radius_m)


def about(axis: FloatArray, angles_rad: FloatArray) -> FloatArray:
    """Return `(k, 4)`: rotations by `(k,)` angles about a unit vector `(3,)`."""
    half = angles_rad[:, None] / 2
    return np.hstack([np.sin(half) * axis, np.cos(half)])


def product(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return `(..., 4)`: rotation `first`, followed by `second` within the rotated frame."""
    (v, w), (u, s) = (first[..., :3], first[..., 3:]), (second[..., :3], second[..., 3:])
    return np.concatenate([w * u + s * v + np.cross(v, u), w * s - np.sum(v * u, axis=-1, keepdims=True)], axis=-1)


def rotated(rotations: FloatArray, vector: FloatArray) -> FloatArray:
    """Return `(..., 3)`: the vector `(3,)` rotated by `(..., 4)`."""
    v, w = rotations[..., :3], rotations[..., 3:]
    across = 2 * np.cross(v, vector)
    return np.asarray(vector + w * across + np.cross(v, across))
