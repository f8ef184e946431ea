"""Samples that were measured before an experiment, read from a table without a service."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.core.robot_files import read_robot_file
from gaplab.services.core.robot_library import IMPORTED
from gaplab.services.core.robots import robots
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.sample_tables import read_samples as read_table
from gaplab.services.plugins import folders
from gaplab.services.replay.earlier_traces import with_traces
from gaplab.services.specs.robots import robot_of_file


def read_samples(
    path: str | Path, robot: str | Path, options: Mapping[str, Any] | None = None, *, confirmed: bool = False
) -> list[dict[str, Any]]:
    """Return the samples of a CSV file, for `reality.samples` of a spec.

        spec["reality"] = {"kind": "physical", "samples": gaplab.read_samples("runs.csv", "quadruped")}

    The columns are `gene_0`, `gene_1` and so on; `value`, or `value_1`, `value_2` and so on for repeats; and optionally
    readings like `roll@0.75`, or `roll@0.75#2` of repeat 2. In place of values and readings, `trace`, or `trace_1`,
    `trace_2` and so on, may name recordings of the robot's base beside the file, from which its code computes both;
    `lag_s`, or `lag_s_1` and so on, may state when the motion began on their clocks.

    Args:
        path: the file.
        robot: name of the robot that was measured: gaplab's own, or one of GAPLAB_PLUGINS; or its robot file, like
            `"my_bot.json"`. `client.bench.check_samples` knows the robots that a service has, and other controllers.
        options: its options, which one from a file does not have; left out: their defaults.
        confirmed: take traces that are unlikely: with gaps, with another start, or of another drive.

    Raises:
        InvalidSamples: the file or a trace has errors, or a trace is unlikely and not `confirmed`; all are named.
        InvalidSpec: the robot does not exist, or refuses its options.
        TypeError: the robot is neither a name nor a file.
    """
    if not isinstance(robot, str | Path):
        raise TypeError(f"a robot is its name or its file, not {robot!r:.100}; give its options as `options`")
    file = Path(path)
    folders.find()
    measured = _robot(robot, dict(options or {}), file)
    return read_table(with_traces(file, measured, confirmed=confirmed), measured).checked(file)


def _robot(robot: str | Path, options: dict[str, Any], table: Path) -> Robot:
    """Return the robot of a table.

    Raises:
        InvalidSpec: it does not exist, or refuses its options.
    """
    if isinstance(robot, Path) or robot.endswith(".json"):
        if options:
            message = f"the robot of {robot} comes from a file, which has no options"
            raise InvalidSpec([Violation("/robot/options", options, message, "left out")])
        return robot_of_file(read_robot_file(Path(robot).read_bytes()))
    if robot in robots or robot in robots.unusable:
        return robots.create(PluginRef(name=robot, options=options), "/robot")
    known = [name for name in robots if name != IMPORTED]
    message = (
        f"unknown robot {robot!r}: read_samples needs no service, and knows {', '.join(known)}, and robot files like "
        f"'{robot}.json'; for a robot of a service use client.bench.check_samples({str(table)!r}, {robot!r})"
    )
    raise InvalidSpec([Violation("/robot", robot, message, tuple(known))])
