"""Tuned values in the files of robots: written, read again, and their rollouts compared."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gaplab.schemas.records import SimulatorRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import InvalidRobot
from gaplab.services.findings.wording import interval
from gaplab.services.robots.comparing import check_rollouts, plain_distance_m
from gaplab.services.robots.writing import Tuning, WrittenFile, write_json, write_plain, write_xml
from gaplab.services.specs.assembly import edits_of, engine_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.simulation import Simulation
from gaplab.services.world.robot_files import RobotFile
from gaplab.services.world.robot_library import robot_file
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.world import World


@dataclass(frozen=True)
class Written:
    """A robot's file that was written.

    Attributes:
        path: the file.
        file: what is in it.
        distance_m: largest distance of a rollout of the file, read again, from one of the tuned simulator.
        plain_distance_m: the same in MuJoCo alone, with one friction and no restitution; None if it was not compared.
    """

    path: Path
    file: WrittenFile
    distance_m: float
    plain_distance_m: float | None

    def __repr__(self) -> str:
        return f"<{self.path}: {len(self.file.changes)} values written, {len(self.file.left_out)} left out>"

    @property
    def facts(self) -> dict[str, Any]:
        """What was written, as JSON."""
        return {
            "file": str(self.path),
            "written": list(map(str, self.file.changes)),
            "left_out": list(map(str, self.file.left_out)),
            "computed": list(map(str, self.file.computed)),
            "largest_distance_m": self.distance_m,
            "plain_mujoco_distance_m": self.plain_distance_m,
        }

    def lines(self) -> Iterator[str]:
        """Yield what was written, in words."""
        yield from (f"  {change}" for change in self.file.changes)
        yield from (f"  not in the file: {change}" for change in self.file.left_out)
        yield from (f"  an import computes it: {change}" for change in self.file.computed)
        what = "with the values that are not in it, rollouts are" if self.file.left_out else "rollouts are"
        near = f"in gaplab's engine, {what} within {self.distance_m:.2g} m of the tuned simulator's."
        yield f"Wrote {self.path}: {near}"
        if (plain := self.plain_distance_m) is not None:
            yield f"MuJoCo alone, with one friction and no restitution, differs by up to {plain:.2g} m within a second."


def write_robot(
    id: str,
    spec: ResolvedSpec,
    best: SimulatorRead,
    output: Path,
    original: Path | None,
    *,
    partial: bool,
) -> Written:
    """Write a simulator of an experiment into the file of its robot, unless the rollouts of that differ.

    Args:
        id: id of the experiment.
        spec: its spec.
        best: the simulator.
        output: the file: `.urdf`, `.xml` or `.json`.
        original: the URDF or MJCF that the robot was imported from, which is copied; None for a `.json`, or for an MJCF
            of the simulator for MuJoCo alone.
        partial: whether values that the format has no place for are left out; they become comments.

    Raises:
        InvalidRobot: it was not written; with every reason.
    """
    robot, engine, edits = robot_of(spec), engine_of(spec.engine), edits_of(ref.name for ref in spec.tunables)
    file, distances = _robot_file(spec, robot), [0.0]
    tuned = Simulation(robot, engine, edits).world(frozen([best.parameters[ref.name] for ref in spec.tunables]))
    comments = [
        _comment(ref.name, best, edit.read(file.world), edit.unit)
        for ref, edit in zip(spec.tunables, edits, strict=True)
    ]

    def accept(world: World) -> None:
        distances.append(check_rollouts(tuned, world, engine, file.usual_controller, file.usual_task))

    tuning = Tuning(file, tuned, (_headline(id, best), *comments), partial)
    if output.suffix.lower() == ".json":
        written = write_json(tuning, output, accept)
    elif original is not None:
        written = write_xml(tuning, original, output, accept)
    elif output.suffix.lower() == ".xml":
        written = write_plain(tuning, output)
    else:
        raise InvalidRobot(
            [f"{output.name} is a copy of the robot's file: give that with --from, or write a .json or .xml"]
        )
    plain_m = plain_distance_m(tuned, engine, file.usual_controller, file.usual_task)
    return Written(output, written, max(distances), plain_m)


def _robot_file(spec: ResolvedSpec, robot: Robot) -> RobotFile:
    driver, task = spec.controller or robot.usual_controller, spec.task or robot.usual_task
    if driver is None or task is None or not robot.world.bodies:
        why = "it has no bodies, or no controller that a file can name"
        raise InvalidRobot([f"the robot {spec.robot.name} cannot be written as a file: {why}"])
    known = robot_file(spec.robot.options.get("sha256", ""))
    if known is None:
        return RobotFile(name=spec.robot.name, usual_controller=driver, usual_task=task, world=robot.world)
    return known.model_copy(update={"usual_controller": driver, "usual_task": task})


def _headline(id: str, best: SimulatorRead) -> str:
    return f"Tuned by gaplab: experiment {id}, repetition {best.repetition}, iteration {best.iteration}."


def _comment(name: str, best: SimulatorRead, before: float, unit: str) -> str:
    unit = "" if unit == "1" else f" {unit}"
    ends = (best.intervals or {}).get(name)
    stated = interval(*ends, "{:.6g}".format) if ends else "the tuner gives no interval"
    return f"{name} = {best.parameters[name]:.6g}{unit}, {stated}; before {before:.6g}{unit}"
