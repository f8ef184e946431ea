"""The motion of a controller as files that a robot's own software reads."""

import csv
import io
import json
from collections.abc import Sequence
from typing import Any, Literal

import yaml

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.errors import Conflict
from gaplab.services.core.motions import Loop, Motion, open_loop
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.stored_specs import spec_of
from gaplab.services.core.world import Joint, PDMotor
from gaplab.services.specs.robots import robot_of
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import requests
from gaplab.services.store.session import Session, snapshot

MotionFormat = Literal["csv", "json", "ros2"]

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
        raise Conflict(_why_not(robot, genome))
    motion, actuators = open_loop(robot.motion(genome)), robot.world.actuators
    if form == "csv":
        return _csv(motion, actuators)
    if form == "json":
        return json.dumps(_plain(motion, actuators), indent=1, ensure_ascii=False) + "\n"
    return _ros2(motion, actuators)


def forms_of(robot: Robot, genome: FloatArray) -> tuple[MotionFormat, ...]:
    """Return the forms in which the motion of a genome `(g,)` can be written."""
    if not robot.world.actuators or isinstance(robot.motion(genome), Loop):
        return ()
    return ("csv", "json") if _others(robot) else ("csv", "json", "ros2")


def _why_not(robot: Robot, genome: FloatArray) -> str:
    """Return why a motion cannot be written in a form that `forms_of` leaves out."""
    if not robot.world.actuators:
        return f"the {robot.label} has no actuators, so its controller has no motion; measure it by its genome"
    if isinstance(robot.motion(genome), Loop):
        return (
            "the controller observes the robot while it acts, so no targets are known in advance; run the controller "
            "itself, with the genome, on the robot"
        )
    others = ", ".join(_others(robot))
    return f"a JointTrajectory has positions, and these motors follow others: {others}; take csv"


def _others(robot: Robot) -> list[str]:
    """Return the actuators whose targets are velocities or torques, with what they follow."""
    followed = [(joint.name, _follows(joint)) for joint in robot.world.actuators]
    return [f"{name} ({follows})" for name, follows in followed if follows != "position"]


def _follows(joint: Joint) -> str:
    return joint.motor.follows if isinstance(joint.motor, PDMotor) else "position"


def _unit_of(joint: Joint) -> str:
    return _UNITS[_follows(joint)][joint.slides]


def _plain(motion: Motion, actuators: Sequence[Joint]) -> dict[str, Any]:
    return {
        "actuators": [joint.name for joint in actuators],
        "units": [_unit_of(joint) for joint in actuators],
        "times_s": motion.times_s.tolist(),
        "targets": motion.targets.tolist(),
        "observe_s": motion.observe_s.tolist(),
    }


def _csv(motion: Motion, actuators: Sequence[Joint]) -> str:
    """Return a line for each change of targets, and a last one at the end."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time_s", *(f"{joint.name} ({_unit_of(joint)})" for joint in actuators)])
    writer.writerows([time, *targets] for time, targets in _points(motion))
    return text.getvalue()


def _ros2(motion: Motion, actuators: Sequence[Joint]) -> str:
    """Return a trajectory_msgs/JointTrajectory in YAML, in which each step of a target is a steep line."""
    at: dict[int, list[float]] = {}
    before, last = 0, None
    for time, targets in _points(motion):
        now = round(time * 1e9)
        if last is not None and now - before > 1:
            at[now - min(BEFORE_NS, (now - before) // 2)] = last
        at[now] = last = targets
        before = now
    points = [{"positions": targets, "time_from_start": _time(place)} for place, targets in at.items()]
    told = {"joint_names": [joint.name for joint in actuators], "points": points}
    return str(yaml.safe_dump(told, sort_keys=False, default_flow_style=None))


def _points(motion: Motion) -> list[tuple[float, list[float]]]:
    """Return the times of changes with the targets from then on, to the last observation."""
    points = list(zip(motion.times_s.tolist(), motion.targets.tolist(), strict=True))
    end = float(motion.observe_s[-1])
    kept = [(time, targets) for time, targets in points if time < end]
    return [*kept, (end, kept[-1][1])] if kept else []


def _time(nanoseconds: int) -> dict[str, int]:
    return {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}
