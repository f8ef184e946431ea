"""The motion of a controller as files that a robot's own software reads."""

import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, Literal

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.errors import Conflict
from gaplab.services.csv_tables import csv_text
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import requests
from gaplab.services.store.session import Session, snapshot
from gaplab.services.world.controllers.parts import middles
from gaplab.services.world.motions import Loop, Motion, open_loop
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.world import Joint, World

MotionFormat = Literal["csv", "json", "ros2"]

REST_S = 1.0
"""Rest in the start pose before a motion: a recording that begins in it shows when the motion began."""

BEFORE_NS = 1_000_000
"""Nanoseconds before a step at which a JointTrajectory, which is interpolated, has a second point."""

_UNITS = {"position": ("rad", "m"), "velocity": ("rad/s", "m/s"), "torque": ("N·m", "N")}
"""Units of targets by what the motor follows: those of a hinge and of a slide."""


@snapshot
def request_motion(session: Session, id_: str, form: MotionFormat) -> str:
    """Return the motion that a request asks for, as text.

    Raises:
        NotFound: the request does not exist.
        InvalidSpec: the robot is not installed here.
        Conflict: the motion cannot be written in this form.
    """
    row, repetition = requests.get(session, id_)
    experiment = session.get_one(ExperimentRow, repetition.experiment_id)
    return written(spec_of(experiment.spec), frozen(row.genome), form)


def written(spec: ResolvedSpec, genome: FloatArray, form: MotionFormat) -> str:
    """Return the motion of a genome `(g,)` as text.

    Raises:
        Conflict: the motion cannot be written in this form.
    """
    robot = robot_of(spec)
    if form not in forms_of(robot, genome):
        positions = "a JointTrajectory has positions only, and these motors follow something else"
        raise Conflict(_why_none(robot, genome) or f"{positions}: {', '.join(_others(robot))}; take the format csv")
    motion, world = open_loop(robot.motion(genome)), robot.world
    if form == "csv":
        return _csv(motion, world)
    if form == "json":
        return json.dumps(_plain(motion, world), indent=1, ensure_ascii=False) + "\n"
    return _ros2(motion, world)


def between_repeats(world: World) -> str:
    """Return how a robot with bodies begins a motion, and what to do between repeats."""
    starts = dict[str, list[str]]()
    for joint in world.joints:
        starts.setdefault(f"{joint.start:.4g} {'m' if joint.slides else 'rad'}", []).append(joint.name)
    pose = "; ".join(f"{start}: {', '.join(names) if len(starts) > 1 else 'all'}" for start, names in starts.items())
    base = "" if world.fixed else f", put the base down as at first, its frame {world.start_height_m:.3g} m high,"
    before = f"Before each repeat, move the joints slowly to the start pose ({pose}){base}"
    return f"{before} and let it rest for {REST_S:g} s. After it, hold the last targets until the robot is safe."


def forms_of(robot: Robot, genome: FloatArray) -> tuple[MotionFormat, ...]:
    """Return the forms in which the motion of a genome `(g,)` can be written."""
    if _why_none(robot, genome):
        return ()
    return ("csv", "json") if _others(robot) else ("csv", "json", "ros2")


def _why_none(robot: Robot, genome: FloatArray) -> str | None:
    """Return why a motion cannot be written in any form; None if it can."""
    if not robot.world.actuators:
        return f"the {robot.label} has no actuators, so its controller has no motion; measure it by its genome"
    if isinstance(robot.motion(genome), Loop):
        return (
            "the controller observes the robot while it acts, so no targets are known in advance; run the controller "
            "itself, with the genome, on the robot"
        )
    return None


def _others(robot: Robot) -> list[str]:
    """Return the actuators whose targets are velocities or torques, with what they follow."""
    followed = [(joint.name, joint.follows) for joint in robot.world.actuators]
    return [f"{name} ({follows})" for name, follows in followed if follows != "position"]


def _unit_of(joint: Joint) -> str:
    return _UNITS[joint.follows][joint.slides]


def _plain(motion: Motion, world: World) -> dict[str, Any]:
    return {
        "start": {joint.name: joint.start for joint in world.joints},
        "between_repeats": between_repeats(world),
        "actuators": [joint.name for joint in world.actuators],
        "units": [_unit_of(joint) for joint in world.actuators],
        "times_s": motion.times_s.tolist(),
        "targets": motion.targets.tolist(),
        "observe_s": motion.observe_s.tolist(),
    }


def _csv(motion: Motion, world: World) -> str:
    """Return a line for the rest before time 0, one for each change of targets, and a last one at the end."""
    header = ["time_s", *(f"{joint.name} ({_unit_of(joint)})" for joint in world.actuators)]
    return csv_text(header, ([time, *targets] for time, targets in _points(motion, world)))


def _ros2(motion: Motion, world: World) -> str:
    """Return a trajectory_msgs/JointTrajectory in YAML: steep lines between steps, plain ones along smooth curves."""
    ramp_ns = round(motion.every_s * 1e9) or BEFORE_NS
    at: dict[int, list[float]] = {}
    before, last = 0, None
    for time, targets in _points(motion, world):
        now = round((time + REST_S) * 1e9)
        if last is not None:
            at[max(before, now - ramp_ns)] = last
        at[now] = last = targets
        before = now
    remarks = [f"The motion begins at {REST_S:g} s. {between_repeats(world)}", *_fastest(world.actuators, at)]
    lines = [f"# {remark}" for remark in remarks]
    lines += [f"joint_names: {json.dumps([joint.name for joint in world.actuators])}", "points:"]
    for place, targets in at.items():
        seconds, nanoseconds = divmod(place, 10**9)
        lines.append(f"- positions: [{', '.join(map(_number, targets))}]")
        lines.append(f"  time_from_start: {{sec: {seconds}, nanosec: {nanoseconds}}}")
    return "\n".join(lines) + "\n"


def _fastest(actuators: Sequence[Joint], at: Mapping[int, Sequence[float]]) -> Iterator[str]:
    """Yield the largest speed of each joint along the lines of a trajectory, and its limit if it is known."""
    lines = list(pairwise(at.items()))
    for place, joint in enumerate(actuators):
        speed = max(abs(two[place] - one[place]) / (after - before) * 1e9 for (before, one), (after, two) in lines)
        limit = getattr(joint.motor, "max_speed_rad_s", "not known")
        yield f"{joint.name}: up to {speed:.3g} {'m/s' if joint.slides else 'rad/s'}; its limit is {limit}"


def _points(motion: Motion, world: World) -> list[tuple[float, list[float]]]:
    """Return the rest in the start pose, then the times of changes with the targets from then on, to the end."""
    changes = zip(motion.times_s.tolist(), motion.targets.tolist(), strict=True)
    end = float(motion.observe_s[-1])
    kept = [(-REST_S, middles(world).tolist()), *((time, targets) for time, targets in changes if time < end)]
    return [*kept, (end, kept[-1][1])]


def _number(value: float) -> str:
    """Return a number as YAML reads one: with a point, also before an exponent."""
    text = repr(value)
    return text if "." in text else text.replace("e", ".0e")
