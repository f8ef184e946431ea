"""Poses of a world's bodies, given its base and joint angles, and their heights. Quaternions are x, y, z, w.

They are used as the engine returns them. scipy's `Rotation` would normalise the single precision of PhysX, which moves
bodies by 1e-8, and refuses the nan of failed physics.

A controller in a loop asks for heights in every period, so `Clearances` carries only the upward direction, as each body
sees it, from joint to joint. Each row of its results depends on the same row of the arguments alone, to the last bit.
"""

from collections.abc import Sequence

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.world.world import UNTURNED, Body, Box, Capsule, Cylinder, Hull, Joint, Part, Shape, World

TOUCHING_M = 0.002
"""Height of the lowest point below which a body touches the ground: engines separate surfaces by less."""


def body_poses(world: World, poses: FloatArray, angles_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return positions `(k, bodies, 3)` and orientations `(k, bodies, 4)` of the bodies' frames, in the world's order.

    Args:
        world: bodies and joints.
        poses: `(k, 7)`: poses of the base.
        angles_rad: `(k, joints)`, in the world's order; m for a joint that slides.
    """
    places = {body.name: place for place, body in enumerate(world.bodies)}
    positions = np.empty((len(poses), len(places), 3))
    orientations = np.empty((len(poses), len(places), 4))
    positions[:, 0], orientations[:, 0] = poses[:, :3], poses[:, 3:]
    for number in _outwards(world):
        joint, angles = world.joints[number], angles_rad[:, number]
        parent, child = places[joint.parent], places[joint.child]
        frame = positions[:, parent], orientations[:, parent]
        positions[:, child], orientations[:, child] = _carried(joint, *frame, angles)
    return positions, orientations


def observed_poses(world: World, poses: FloatArray, angles_rad: FloatArray) -> FloatArray:
    """Return `(k, 7)`: poses of the body whose motion is the trajectory; arguments are as of `body_poses`.

    Angles are not read if the base is observed.
    """
    if observes_base(world):
        return poses
    position, turn = poses[:, :3], poses[:, 3:]
    for place in reversed(chain(world, world.observed)):
        position, turn = _carried(world.joints[place], position, turn, angles_rad[:, place])
    return np.hstack([position, turn])


def chain(world: World, body: str) -> list[int]:
    """Return the numbers of the joints that carry a body, from its own to the one at the base."""
    carriers = {joint.child: number for number, joint in enumerate(world.joints)}
    found: list[int] = []
    while body in carriers:
        found.append(carriers[body])
        body = world.joints[found[-1]].parent
    return found


def observes_base(world: World) -> bool:
    """Return whether the trajectory is that of the base."""
    return not world.observed or world.observed == world.bodies[0].name


def from_start(world: World, orientations: FloatArray) -> FloatArray:
    """Return `(..., 4)`: the rotations from the orientation of the base at the start, along the axes of the world."""
    if world.start_turn == UNTURNED:
        return orientations
    return product(orientations, inverse(np.array(world.start_turn)))


def _outwards(world: World) -> tuple[int, ...]:
    """Return the numbers of the joints, each after the joint of its parent, and else in the world's order."""
    placed = {world.bodies[0].name}
    order: list[int] = []
    left = list(enumerate(world.joints))
    while left:
        for number, joint in left:
            if joint.parent in placed:
                placed.add(joint.child)
                order.append(number)
        left = [pair for pair in left if pair[1].child not in placed]
    return tuple(order)


def _carried(joint: Joint, position: FloatArray, turn: FloatArray, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position `(k, 3)` and orientation `(k, 4)` of a joint's child, given those of its parent."""
    position = position + rotated(turn, np.array(joint.origin_m))
    if joint.turn != UNTURNED:
        turn = product(turn, np.array(joint.turn))
    axis = np.array(joint.axis)
    if joint.slides:
        return position + angles[:, None] * rotated(turn, axis), turn
    return position, product(turn, about(axis, angles))


def lowest_m(world: World, turn: FloatArray) -> float:
    """Return the height of the lowest point that touches the ground, at the start, above the frame of the base.

    The base has the rotation `turn`, `(4,)`.
    """
    pose = np.array([[0.0, 0.0, 0.0, *turn]])
    positions, turns = body_poses(world, pose, np.array([[joint.start for joint in world.joints]]))
    touching = [place for place, body in enumerate(world.bodies) if body.touches] or range(len(world.bodies))
    return min(float(clearances_m(world.bodies[place], positions[:, place], turns[:, place])[0]) for place in touching)


def tilted_pose(world: World, tilt_rad: tuple[float, float]) -> FloatArray:
    """Return `(7,)`: pose of the base at time 0, tilted about x and y of the world; its lowest point is as high."""
    angle = float(np.hypot(*tilt_rad))
    axis = np.array([*tilt_rad, 0.0]) / angle
    level = np.array(world.start_turn)
    turn = product(about(axis, np.array([angle]))[0], level)
    return np.array([0.0, 0.0, world.start_height_m + lowest_m(world, level) - lowest_m(world, turn), *turn])


def clearances_m(body: Body, positions: FloatArray, orientations: FloatArray) -> FloatArray:
    """Return `(k,)`: the height of the lowest point of a body above the ground, negative inside it.

    Args:
        body: body with its shapes; those that collide count, or all if none collides.
        positions: `(k, 3)`: positions of the body's frame.
        orientations: `(k, 4)`: orientations of the body's frame.
    """
    parts = [part for part in body.parts if part.collides] or body.parts
    lowest = [_lowest(part, positions, orientations) for part in parts]
    return lowest[0] if len(lowest) == 1 else np.asarray(np.min(lowest, axis=0))


def _lowest(part: Part, positions: FloatArray, orientations: FloatArray) -> FloatArray:
    """Return `(k,)`: the height of the lowest point of one shape."""
    center = positions[:, 2] + rotated(orientations, np.array(part.center_m))[:, 2]
    turn = orientations if part.turn == UNTURNED else product(orientations, np.array(part.turn))
    return np.asarray(center - _reach(part.shape, turn))


def _reach(shape: Shape, turn: FloatArray) -> FloatArray | float:
    """Return `(k,)`: how far a shape reaches below its frame, in each of its orientations `(k, 4)`."""
    match shape:
        case Box():
            edges = np.diag(np.array(shape.size_m) / 2)
            return np.asarray(sum(np.abs(rotated(turn, edge)[:, 2]) for edge in edges))
        case Capsule():
            return np.asarray(shape.radius_m + shape.length_m / 2 * np.abs(_rise(turn)))
        case Cylinder():
            rise = _rise(turn)
            level = np.sqrt(np.maximum(1 - rise * rise, 0.0))
            return np.asarray(shape.radius_m * level + shape.length_m / 2 * np.abs(rise))
        case Hull():
            return np.asarray(-rotated(turn[:, None], np.array(shape.points_m))[..., 2].min(axis=1))
        case _:
            return shape.radius_m


def _rise(turn: FloatArray) -> FloatArray:
    """Return `(k,)`: the height of the end of the z axis, of length 1, in each orientation."""
    return rotated(turn, np.array([0.0, 0.0, 1.0]))[:, 2]


def about(axis: FloatArray, angles_rad: FloatArray) -> FloatArray:
    """Return `(k, 4)`: rotations by `(k,)` angles about a unit vector `(3,)`."""
    half = angles_rad[:, None] / 2
    return np.hstack([np.sin(half) * axis, np.cos(half)])


def product(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return `(..., 4)`: rotation `first`, followed by `second` within the rotated frame."""
    (v, w), (u, s) = (first[..., :3], first[..., 3:]), (second[..., :3], second[..., 3:])
    return np.concatenate([w * u + s * v + _cross(v, u), w * s - np.sum(v * u, axis=-1, keepdims=True)], axis=-1)


def rotated(rotations: FloatArray, vector: FloatArray) -> FloatArray:
    """Return `(..., 3)`: vectors `(..., 3)` rotated by `(..., 4)`."""
    v, w = rotations[..., :3], rotations[..., 3:]
    across = 2 * _cross(v, vector)
    return np.asarray(vector + w * across + _cross(v, across))


def inverse(rotations: FloatArray) -> FloatArray:
    """Return `(..., 4)`: the rotations back."""
    return np.asarray(rotations * np.array([-1.0, -1.0, -1.0, 1.0]))


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return `(..., 3)`: cross products, to the bit as numpy's, in a third of its time for few vectors."""
    x, y, z = first[..., 0], first[..., 1], first[..., 2]
    u, v, w = second[..., 0], second[..., 1], second[..., 2]
    ahead = y * w - z * v
    found = np.empty((*ahead.shape, 3))
    found[..., 0], found[..., 1], found[..., 2] = ahead, z * u - x * w, x * v - y * u
    return found


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
