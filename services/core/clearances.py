"""Heights of many bodies above the ground at once: what a controller in a loop asks for in every period.

Only the upward direction, as each body sees it, is carried from joint to joint. Each row of the results depends on the
same row of the arguments alone, to the last bit.
"""

from collections.abc import Sequence

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.kinematics import chain, rotated
from gaplab.services.core.shapes import Box, Capsule, Cylinder, Hull, Part
from gaplab.services.core.world import Body, World


class Clearances:
    """Heights of the lowest points of some bodies above the ground, negative inside it.

    Args:
        world: bodies and joints.
        bodies: b of its bodies that touch the ground.
    """

    def __init__(self, world: World, bodies: Sequence[Body]) -> None:
        self._levels = [_Level(world, numbers) for numbers in _levels(world)]
        self._size = len(world.bodies)
        self._parts = _Parts(world, bodies)

    def __call__(self, poses: FloatArray, angles_rad: FloatArray) -> FloatArray:
        """Return `(n, b)`, m.

        Args:
            poses: `(n, 7)`: poses of the base.
            angles_rad: `(n, joints)`, in the world's order; m for a joint that slides.
        """
        ups, heights = np.empty((len(poses), self._size, 3)), np.empty((len(poses), self._size))
        x, y, z, w = poses[:, 3], poses[:, 4], poses[:, 5], poses[:, 6]
        ups[:, 0, 0], ups[:, 0, 1], ups[:, 0, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
        heights[:, 0] = poses[:, 2]
        for level in self._levels:
            level.carry(ups, heights, angles_rad)
        return self._parts.lowest(ups, heights)


class _Level:
    """Joints that are equally far from the base, so that their children are placed at once."""

    def __init__(self, world: World, numbers: Sequence[int]) -> None:
        joints = [world.joints[number] for number in numbers]
        places = {body.name: place for place, body in enumerate(world.bodies)}
        self._numbers = list(numbers)
        self._parents = [places[joint.parent] for joint in joints]
        self._children = [places[joint.child] for joint in joints]
        self._origins = np.array([joint.origin_m for joint in joints])
        self._turns = np.array([rotated(np.array(joint.turn), np.eye(3)) for joint in joints])
        self._axes = np.array([joint.axis for joint in joints])
        self._slides = np.array([joint.slides for joint in joints])

    def carry(self, ups: FloatArray, heights: FloatArray, angles_rad: FloatArray) -> None:
        """Write the rows of the children of `(n, bodies, 3)` and `(n, bodies)`, given those of their parents."""
        up, axes, angles = ups[:, self._parents], self._axes, angles_rad[:, self._numbers]
        height = heights[:, self._parents] + _dot(up, self._origins)
        up = _seen_from(up, self._turns)
        along = _dot(up, axes)
        turned = np.where(self._slides, 0.0, angles)
        cos, sin = np.cos(turned), np.sin(turned)
        lifted = along * (1 - cos)
        u, v, w = up[..., 0], up[..., 1], up[..., 2]
        x, y, z = axes[:, 0], axes[:, 1], axes[:, 2]
        found = np.empty_like(up)
        found[..., 0] = u * cos - (y * w - z * v) * sin + x * lifted
        found[..., 1] = v * cos - (z * u - x * w) * sin + y * lifted
        found[..., 2] = w * cos - (x * v - y * u) * sin + z * lifted
        ups[:, self._children] = found
        heights[:, self._children] = height + np.where(self._slides, angles, 0.0) * along


class _Parts:
    def __init__(self, world: World, bodies: Sequence[Body]) -> None:
        places = {body.name: place for place, body in enumerate(world.bodies)}
        by_body = [[part for part in body.parts if part.collides] for body in bodies]
        parts = [part for group in by_body for part in group]
        self._firsts = np.cumsum([0, *(len(group) for group in by_body)])[:-1]
        self._places = [places[body.name] for body, group in zip(bodies, by_body, strict=True) for _ in group]
        self._centers = np.array([part.center_m for part in parts]).reshape(-1, 3)
        self._turns = np.array([rotated(np.array(part.turn), np.eye(3)) for part in parts]).reshape(-1, 3, 3)
        sizes = np.array([_sizes(part) for part in parts]).reshape(-1, 5)
        self._halves, self._radii, self._discs = sizes[:, :3], sizes[:, 3], sizes[:, 4]
        self._hulls = [
            (i, np.array(part.shape.points_m)) for i, part in enumerate(parts) if isinstance(part.shape, Hull)
        ]

    def lowest(self, ups: FloatArray, heights: FloatArray) -> FloatArray:
        """Return `(n, b)`: the heights of the lowest points of the bodies."""
        if not self._places:
            return np.empty((len(ups), 0))
        up = ups[:, self._places]
        center = heights[:, self._places] + _dot(up, self._centers)
        up = _seen_from(up, self._turns)
        level = np.sqrt(np.maximum(1 - up[..., 2] * up[..., 2], 0.0))
        reach = _dot(np.abs(up), self._halves) + self._radii + self._discs * level
        for place, points in self._hulls:
            reach[:, place] = -_dot(up[:, place, None], points).min(axis=1)
        return np.asarray(np.minimum.reduceat(center - reach, self._firsts, axis=1))


def _levels(world: World) -> list[list[int]]:
    """Return the numbers of the joints by the number of joints between them and the base."""
    levels: dict[int, list[int]] = {}
    for number, joint in enumerate(world.joints):
        levels.setdefault(len(chain(world, joint.parent)), []).append(number)
    return [levels[depth] for depth in sorted(levels)]


def _sizes(part: Part) -> tuple[float, ...]:
    """Return half the edges, the radius of a ball around them, and that of a disc: 0 for a hull."""
    match part.shape:
        case Box(size_m=(x, y, z)):
            return x / 2, y / 2, z / 2, 0.0, 0.0
        case Capsule(radius_m=radius, length_m=length):
            return 0.0, 0.0, length / 2, radius, 0.0
        case Cylinder(radius_m=radius, length_m=length):
            return 0.0, 0.0, length / 2, 0.0, radius
        case Hull():
            return 0.0, 0.0, 0.0, 0.0, 0.0
        case _:
            return 0.0, 0.0, 0.0, part.shape.radius_m, 0.0


def _dot(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return `(...)`: the dot products of vectors `(..., 3)`, in plain sums."""
    products = one * other
    return np.asarray(products[..., 0] + products[..., 1] + products[..., 2])


def _seen_from(vectors: FloatArray, axes: FloatArray) -> FloatArray:
    """Return `(n, m, 3)`: vectors in frames whose axes are the rows of `(m, 3, 3)`."""
    return np.stack([_dot(vectors, axes[:, 0]), _dot(vectors, axes[:, 1]), _dot(vectors, axes[:, 2])], axis=-1)
