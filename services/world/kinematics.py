"""Poses of a world's bodies, given its base and joint angles, and their heights. Quaternions are x, y, z, w.

They are used as the engine returns them. scipy's `Rotation` would normalise the single precision of PhysX, which moves
bodies by 1e-8, and refuses the nan of failed physics.

Each row of the results depends on the same row of the arguments alone, to the last bit.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import PluginBroken
from gaplab.services.world.motions import LEVEL, Loop, Motion, Start
from gaplab.services.world.world import (
    ORIGIN,
    UNTURNED,
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Joint,
    Part,
    Shape,
    Vector,
    World,
)

TOUCHING_M = 0.002
"""Height of the lowest point below which a body touches the ground: engines separate surfaces by less."""


def body_poses(world: World, poses: FloatArray, angles_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return positions `(k, bodies, 3)` and orientations `(k, bodies, 4)` of the bodies' frames, in the world's order.

    Poses of the base are `(k, 7)`; angles `(k, joints)` are in the world's order, in m for a joint that slides.
    """
    return Skeleton(world)(poses, angles_rad)


class Skeleton:
    """The joints of a world in groups, from the base outwards: the children of a group are placed at once."""

    def __init__(self, world: World) -> None:
        places, depths = {body.name: place for place, body in enumerate(world.bodies)}, {world.bodies[0].name: 0}
        groups: dict[tuple[int, bool, bool], list[int]] = {}
        for number in outwards(world):
            joint = world.joints[number]
            depth = depths[joint.child] = depths[joint.parent] + 1
            groups.setdefault((depth, joint.slides, joint.turn != UNTURNED), []).append(number)
        self._size = len(places)
        self._groups = []
        for _, numbers in sorted(groups.items()):
            joints = [world.joints[number] for number in numbers]
            parents, children = [places[joint.parent] for joint in joints], [places[joint.child] for joint in joints]
            self._groups.append((_Joints.of(joints), numbers, parents, children))

    def __call__(self, poses: FloatArray, angles_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what `body_poses` does."""
        positions, turns = np.empty((len(poses), self._size, 3)), np.empty((len(poses), self._size, 4))
        positions[:, 0], turns[:, 0] = poses[:, :3], poses[:, 3:]
        for joints, numbers, parents, children in self._groups:
            carried = joints.carried(positions[:, parents], turns[:, parents], angles_rad[:, numbers])
            positions[:, children], turns[:, children] = carried
        return positions, turns


class _Joints(NamedTuple):
    """Joints that slide or turn, all of them, and have turned frames, all or none."""

    origins: FloatArray
    turns: FloatArray | None
    axes: FloatArray
    slide: bool

    @classmethod
    def of(cls, joints: Sequence[Joint]) -> "_Joints":
        """Return joints that are alike."""
        turns = np.array([joint.turn for joint in joints]) if joints[0].turn != UNTURNED else None
        origins, axes = np.array([joint.origin_m for joint in joints]), np.array([joint.axis for joint in joints])
        return cls(origins, turns, axes, joints[0].slides)

    def carried(self, position: FloatArray, turn: FloatArray, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return positions `(k, j, 3)` and orientations `(k, j, 4)` of the children, given those of the parents."""
        position = position + rotated(turn, self.origins)
        if self.turns is not None:
            turn = product(turn, self.turns)
        if self.slide:
            return position + angles[..., None] * rotated(turn, self.axes), turn
        return position, product(turn, about(self.axes, angles))


def outwards(world: World, parent: str | None = None) -> Iterator[int]:
    """Yield the numbers of the joints from a body outwards, depth first; by default from the base."""
    parent = world.bodies[0].name if parent is None else parent
    for number, joint in enumerate(world.joints):
        if joint.parent == parent:
            yield number
            yield from outwards(world, joint.child)


def observed_poses(world: World, poses: FloatArray, angles_rad: FloatArray) -> FloatArray:
    """Return `(k, 7)`: poses of the body whose motion is the trajectory; arguments are as of `body_poses`.

    Angles are not read if the base is observed.
    """
    if observes_base(world):
        return poses
    position, turn = poses[:, None, :3], poses[:, None, 3:]
    for number in reversed(chain(world, world.observed)):
        position, turn = _Joints.of([world.joints[number]]).carried(position, turn, angles_rad[:, [number]])
    return np.concatenate([position, turn], axis=-1)[:, 0]


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


def lowest_m(world: World, turn: FloatArray) -> float:
    """Return the height of the lowest point that touches the ground, at the start, above the frame of the base.

    The base has the rotation `turn`, `(4,)`.
    """
    pose = np.array([[0.0, 0.0, 0.0, *turn]])
    positions, turns = body_poses(world, pose, np.array([[joint.start for joint in world.joints]]))
    touching = [place for place, body in enumerate(world.bodies) if body.touches] or range(len(world.bodies))
    return min(float(clearances_m(world.bodies[place], positions[:, place], turns[:, place])[0]) for place in touching)


class Placed(NamedTuple):
    """How a robot is at time 0: its base, `(7,)` and `(3,)`, as of Start, and its joints, `(joints,)`."""

    pose: FloatArray
    velocity_m_s: FloatArray
    turning_rad_s: FloatArray
    angles_rad: FloatArray
    speeds_rad_s: FloatArray

    def of_centre(self, center_m: Vector) -> tuple[FloatArray, FloatArray]:
        """Return the velocities of the base's centre of mass, `(3,)`, and about it, `(3,)`, along axes of the world."""
        spin = rotated(self.pose[3:], self.turning_rad_s)
        return self.velocity_m_s + _cross(spin, rotated(self.pose[3:], np.array(center_m))), spin


def placed(world: World, motion: Motion | Loop) -> Placed | None:
    """Return how a robot is when a motion begins; None if it is as the world has it.

    A base that is tilted has its lowest point as high, unless the motion says where it is.

    Raises:
        PluginBroken: the start is of another robot.
    """
    if motion.start is None and motion.start_tilt_rad == LEVEL:
        return None
    start, world = motion.start or Start(), started(world, motion)
    level = turn = np.array(start.turn or world.start_turn)
    place = np.array(start.position_m or (0.0, 0.0, world.start_height_m))
    if motion.start_tilt_rad != LEVEL:
        turn = product(turn_by(motion.start_tilt_rad), level)
        place[2] += 0.0 if start.position_m else lowest_m(world, level) - lowest_m(world, turn)
    return Placed(
        np.array([*place, *turn]),
        np.array(start.velocity_m_s or ORIGIN),
        np.array(start.turning_rad_s or ORIGIN),
        np.array([joint.start for joint in world.joints]),
        np.array(start.speeds_rad_s or [0.0] * len(world.joints)),
    )


def started(world: World, motion: Motion | Loop) -> World:
    """Return the world whose joints begin where the motion's start says.

    Raises:
        PluginBroken: the start is of another robot.
    """
    start, count = motion.start, len(world.joints)
    if start is None:
        return world
    for values in (start.angles_rad, start.speeds_rad_s):
        if values is not None and len(values) != count:
            raise PluginBroken(f"the motion starts {len(values)} joints, but the robot has {count}; give one for each")
    base = (start.position_m, start.turn, start.velocity_m_s, start.turning_rad_s)
    if world.fixed and base != (None,) * len(base):
        raise PluginBroken("the motion starts the base, but it never moves; leave position, turn and velocities out")
    if start.angles_rad is None:
        return world
    pairs = zip(world.joints, start.angles_rad, strict=True)
    return replace(world, joints=tuple(replace(joint, start=angle) for joint, angle in pairs))


def turn_by(tilt_rad: tuple[float, float]) -> FloatArray:
    """Return `(4,)`: the rotation by a tilt about x and y, which is not 0."""
    angle = float(np.hypot(*tilt_rad))
    return np.asarray(about(np.array([*tilt_rad, 0.0]) / angle, np.array([angle]))[0])


def clearances_m(body: Body, positions: FloatArray, orientations: FloatArray) -> FloatArray:
    """Return `(k,)`: the height of the lowest point of a body above the ground, negative inside it.

    The shapes that collide count, or all if none collides. Positions `(k, 3)` and orientations `(k, 4)` are those of
    the body's frame.
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
    """Return `(..., 4)`: rotations by angles `(...)` about unit vectors `(..., 3)`."""
    half = angles_rad[..., None] / 2
    return np.concatenate([np.sin(half) * axis, np.cos(half)], axis=-1)


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
    """Heights of the lowest points of b bodies above the ground, as of `clearances_m`."""

    def __init__(self, world: World, bodies: Sequence[Body]) -> None:
        places = {body.name: place for place, body in enumerate(world.bodies)}
        self._skeleton, self._bodies = Skeleton(world), [(body, places[body.name]) for body in bodies]

    def __call__(self, poses: FloatArray, angles_rad: FloatArray) -> FloatArray:
        """Return `(n, b)`, m, given poses of the base `(n, 7)` and angles `(n, joints)`, as of `body_poses`."""
        positions, turns = self._skeleton(poses, angles_rad)
        heights = [clearances_m(body, positions[:, place], turns[:, place]) for body, place in self._bodies]
        return np.reshape(heights, (len(heights), len(poses))).T
