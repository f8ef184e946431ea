"""The robot of a spec, with its controller and its task."""

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.records import SensorsRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.sensitivity import Checked
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.errors import GaplabError, InvalidSpec, Violation, gather
from gaplab.services.world import robot_library
from gaplab.services.world.controllers import controllers
from gaplab.services.world.robot_files import RobotFile
from gaplab.services.world.robots import robots
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.tasks import tasks
from gaplab.services.world.tasks.base import Task


@dataclass(frozen=True)
class Driven:
    """A robot with a controller and a task; None for its own."""

    robot: PluginRef
    controller: PluginRef | None = None
    task: PluginRef | None = None


NamesARobot: TypeAlias = Driven | ExperimentSpec | ResolvedSpec | Checked
"""A robot with what drives and rates it, a spec, or the subject of a sensitivity check."""


def robot_of(spec: NamesARobot) -> Robot:
    """Return a new robot, driven by the controller of a spec and rated by its task.

    Raises:
        InvalidSpec: with every violation: a plug-in is not installed here or refuses its options, or the robot brings a
            controller and a task of its own, and the spec names others.
    """
    robot = robots.create(spec.robot, "/robot")
    if spec.controller is None and spec.task is None:
        return robot
    if robot.usual_controller is None or robot.usual_task is None:
        named = [(place, ref) for place, ref in (("/controller", spec.controller), ("/task", spec.task)) if ref]
        message = f"the {robot.label} brings a controller and a task of its own; leave this out"
        raise InvalidSpec(Violation(place, ref.name, message, "left out") for place, ref in named)
    driving, rating = spec.controller or robot.usual_controller, spec.task or robot.usual_task
    controller, task = gather(lambda: controllers.create(driving, "/controller"), lambda: tasks.create(rating, "/task"))
    return robot.driven_by(controller, task)


def robot_of_file(file: RobotFile) -> Robot:
    """Return the robot of a robot file that was checked, with its usual controller and task.

    Raises:
        InvalidSpec: the controller or the task cannot drive and rate it; pointers are places in the file.
    """
    gather(
        lambda: controllers.create(file.usual_controller, "/usual_controller"),
        lambda: tasks.create(file.usual_task, "/usual_task"),
    )
    robot_library.learn([file.text])
    return robots.create(ref_of_file(file.sha256, file.name))


def ref_of_file(sha256: str, name: str) -> PluginRef:
    """Return how a stored spec names the robot of a file."""
    return PluginRef(name=robot_library.IMPORTED, options={"sha256": sha256, "name": name})


def installed_robot(spec: NamesARobot) -> Robot | None:
    """Return the robot of a stored spec; None if it, its controller or its task is not installed, or its file gone."""
    try:
        return robot_of(spec)
    except InvalidSpec:
        return None


def unit(spec: NamesARobot) -> str:
    """Return the unit of fitness; "" if the robot or the task is not installed."""
    if spec.task is not None:
        return tasks[spec.task.name].unit if spec.task.name in tasks else ""
    try:
        return _own_unit(spec.robot.model_dump_json())
    except InvalidSpec:
        return ""


def sensors(spec: NamesARobot) -> SensorsRead | None:
    """Return the sensors of the robot of a stored spec; None if it or its task is not installed, or its file gone.

    They are those of `robot_of`, also if the controller is not installed.
    """
    try:
        robot = robots.create(spec.robot)
        rating = spec.task or (robot.usual_task if spec.controller else None)
        task: Task | Robot = tasks.create(rating) if rating else robot
        if isinstance(task, Task):
            task.prepare(robot.world)
        found = task.sensors
    except GaplabError:
        return None
    return SensorsRead(
        names=found.names, units=found.units, noises=tuple(found.noises.tolist()), times_s=tuple(found.times_s.tolist())
    )


@lru_cache
def _own_unit(ref: str) -> str:
    return robots.create(PluginRef.model_validate_json(ref)).unit
