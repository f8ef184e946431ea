"""The start of a robot: angles within the limits, and a base at which its lowest point touches the ground."""

from collections.abc import Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from gaplab.services.core.arrays import FloatArray
from gaplab.services.robots.bodies import FREE, Bodies, joint_name, joint_number, quaternion, rotation_of
from gaplab.services.robots.options import ImportOptions, Notes, listed
from gaplab.services.robots.reading import Source, mujoco_library
from gaplab.services.world.world import Body, Box, Capsule, Cylinder, Hull, Joint, Part, Quaternion

ROUNDED = 1e-4
"""Distance from a limit that the rounding of an angle in a file or an option explains, rad or m."""


def start_angles(source: Source, options: ImportOptions, notes: Notes) -> FloatArray:
    """Return MuJoCo's `qpos`, `(nq,)`, at the start: a keyframe or the reference angles, the base as `options.turn`."""
    qpos = _angles_of_the_file(source, options, notes)
    if options.turn is not None:
        if source.model.jnt_type[0] != FREE:
            notes.refuse("the base is fixed to the world, so it cannot be turned")
        else:
            qpos[3:7] = np.roll(quaternion(Rotation.from_euler("xyz", options.turn)), 1)
    return qpos


def _angles_of_the_file(source: Source, options: ImportOptions, notes: Notes) -> FloatArray:
    keyframes = source.keyframes
    if options.keyframe is not None:
        names = [each.name for each in keyframes]
        keyframes = tuple(each for each in keyframes if each.name == options.keyframe)
        if not keyframes:
            notes.refuse(f"there is no keyframe {options.keyframe!r}; keyframes: {listed(names) or 'none'}")
            notes.check()
    return keyframes[0].qpos(source.model) if keyframes else np.array(source.model.qpos0)


def with_starts(
    joints: list[Joint], source: Source, qpos: FloatArray, options: ImportOptions, notes: Notes
) -> list[Joint]:
    """Return the joints with their angles at time 0: the user's, else the file's, else the middle of the limits."""
    model = source.model
    given = {
        joint_name(model, at): float(qpos[int(model.jnt_qposadr[at])])
        for at in range(model.njnt)
        if model.jnt_type[at] != FREE
    }
    unknown = [each for each in options.start if not any(fnmatchcase(joint.name, each) for joint in joints)]
    if unknown:
        names = listed((joint.name for joint in joints), 30)
        notes.refuse(f"no joint has a name like {listed(unknown)}, of which a start was given; joints: {names}")
    return [replace(joint, start=_start(joint, given[joint.name], options.start, notes)) for joint in joints]


def _start(joint: Joint, given: float, chosen: Mapping[str, float], notes: Notes) -> float:
    wanted = [angle for pattern, angle in chosen.items() if fnmatchcase(joint.name, pattern)]
    start = wanted[-1] if wanted else given
    if joint.limits is None:
        return start
    lower, upper = joint.limits
    nearest = min(max(start, lower), upper)
    if abs(start - nearest) <= ROUNDED:
        return nearest
    if wanted:
        notes.refuse(f"{joint.name} cannot start at {start:g}: its limits are {lower:g} to {upper:g}")
        return start
    notes.lose(
        f"starts at {(lower + upper) / 2:.4g}, since {start:g} is outside the limits; --start sets it: {{}}", joint.name
    )
    return (lower + upper) / 2


def base_pose(
    bodies: Bodies, world_bodies: list[Body], joints: list[Joint], qpos: FloatArray, *, fixed: bool
) -> tuple[float, Quaternion]:
    """Return height and rotation of the base: its lowest point touches the ground; a fixed base is only raised.

    Args:
        bodies: the model's bodies.
        world_bodies: the same bodies of the World.
        joints: joints with their starts.
        qpos: `(nq,)`: MuJoCo's start.
        fixed: whether the base never moves.
    """
    model, data = bodies.model, mujoco_library().MjData(bodies.model)
    data.qpos[:] = qpos
    for joint in joints:
        data.qpos[int(model.jnt_qposadr[joint_number(model, joint.name)])] = joint.start
    mujoco_library().mj_kinematics(model, data)
    lowest = [
        lowest_m(part, *_frame(model, data, head))
        for head, body in zip(bodies.heads, world_bodies, strict=True)
        for part in body.parts
        if part.collides
    ]
    place, turn = _frame(model, data, bodies.heads[0])
    height, below = float(place[2]), min(lowest, default=0.0)
    return height - (min(below, 0.0) if fixed else below) + 0.0, quaternion(turn)


def _frame(model: Any, data: Any, head: int) -> tuple[FloatArray, Rotation]:  # noqa: ANN401
    turn = rotation_of(data.xquat[head])
    at = int(model.body_jntadr[head])
    is_free = at < 0 or model.jnt_type[at] == FREE
    return np.asarray(data.xpos[head] + (0 if is_free else turn.apply(model.jnt_pos[at]))), turn


def lowest_m(part: Part, place_m: FloatArray, turn: Rotation) -> float:
    """Return the height of the lowest point of a part.

    Args:
        part: shape on a body.
        place_m: `(3,)`: place of the body's frame.
        turn: rotation of the body's frame.
    """
    center = place_m + turn.apply(part.center_m)
    down = (turn * Rotation.from_quat(part.turn)).as_matrix()[2]
    shape = part.shape
    if isinstance(shape, Box):
        reach = float(np.abs(down) @ np.array(shape.size_m)) / 2
    elif isinstance(shape, Hull):
        reach = -float((np.array(shape.points_m) @ down).min())
    elif isinstance(shape, Cylinder):
        reach = abs(down[2]) * shape.length_m / 2 + shape.radius_m * float(np.sqrt(max(0.0, 1 - down[2] ** 2)))
    else:
        straight = shape.length_m / 2 if isinstance(shape, Capsule) else 0.0
        reach = abs(down[2]) * straight + shape.radius_m
    return float(center[2] - reach)
