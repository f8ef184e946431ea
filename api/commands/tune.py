"""The command that tunes a robot's simulator on a table of measurements, without a service."""

import re
from pathlib import Path
from typing import Annotated, Any

import typer

from gaplab.api.commands.app import SPECS, Answer, AsJson, command
from gaplab.api.commands.json_output import echo
from gaplab.api.commands.tuned import Original, Partial, refusals


@command(SPECS)
def tune(  # noqa: PLR0913, PLR0917 - each is an option of the command
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="name, robot file, URDF or MJCF")],
    runs: Annotated[
        list[str] | None, typer.Argument(metavar="RUNS", help="tables of measurements, as of read_samples")
    ] = None,
    pool: Annotated[Path | None, typer.Option(help="recordings in place of measurements")] = None,
    tunables: Annotated[str | None, typer.Option(help="separated by commas; left out: the robot's usual ones")] = None,
    engine: Annotated[str | None, typer.Option(help="engine; left out: the robot's")] = None,
    tuner: Annotated[str, typer.Option(help="how simulators are found")] = "gauss_newton",
    discrepancy: Annotated[str | None, typer.Option(help="what tuning minimises; left out: errors of fitness")] = None,
    held_out: Annotated[float, typer.Option(help="share of the measurements that tuning does not see")] = 0.2,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="robot file, URDF or MJCF to write")] = None,
    original: Original = None,
    partial: Partial = False,
    save: Annotated[Path | None, typer.Option(help="archive to write, for gaplab.Tuning.load or a service")] = None,
    as_json: AsJson = False,
) -> Answer:
    """Tune a robot's simulator on measurements, print what they identify, and write the tuned values into its file.

    It needs no service, and asks for no further measurement.
    """
    from gaplab.api.library.tuning import Tuning

    labels = None if tunables is None else re.split(r",\s*(?![^()]*\))", tunables)
    if not runs and pool is None:
        raise typer.BadParameter("tables of measurements, or --pool", param_hint="RUNS")
    share: dict[str, Any] = {"held_out": held_out} if pool is None else {"reality": {"held_out": held_out}}
    tuning = Tuning(robot, labels, engine=engine, tuner=tuner, discrepancy=discrepancy, pool=pool, **share)
    for table in runs or ():
        tuning.tell(Path(table))
    found = tuning.simulator
    if save:
        tuning.save(save)
    if output is None:
        return Answer({"simulator": found}, str(found))
    if not as_json:
        echo(str(found))  # also if the file cannot be written
    with refusals(output):
        written = tuning.save_robot(output, original, partial=partial)
    return Answer({"simulator": found, **written.facts}, *written.lines())
