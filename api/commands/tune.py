"""The commands that tune a robot's simulator without a service: on measurements, and on truths to be recovered."""

import re
from pathlib import Path
from typing import Annotated, Any

import typer

from gaplab.api.commands.app import SPECS, Answer, AsJson, command
from gaplab.api.commands.json_output import echo
from gaplab.api.commands.tables import shown
from gaplab.api.commands.tuned import Original, Partial, refusals

Robot = Annotated[str, typer.Argument(metavar="ROBOT", help="name, robot file, URDF or MJCF")]
Tunables = Annotated[str | None, typer.Option(help="separated by commas; left out: the robot's usual ones")]
Engine = Annotated[str | None, typer.Option(help="engine; left out: the robot's")]


@command(SPECS)
def tune(  # noqa: PLR0913, PLR0917 - each is an option of the command
    robot: Robot,
    runs: Annotated[
        list[str] | None, typer.Argument(metavar="RUNS", help="tables of measurements, as of read_samples")
    ] = None,
    pool: Annotated[Path | None, typer.Option(help="recordings in place of measurements")] = None,
    tunables: Tunables = None,
    engine: Engine = None,
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

    if not runs and pool is None:
        raise typer.BadParameter("tables of measurements, or --pool", param_hint="RUNS")
    share: dict[str, Any] = {"held_out": held_out} if pool is None else {"reality": {"held_out": held_out}}
    labels = _labels(tunables)
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


@command(SPECS)
def recover(  # noqa: PLR0913, PLR0917 - each is an option of the command
    robot: Robot,
    tunables: Tunables = None,
    engine: Engine = None,
    tuner: Annotated[str, typer.Option(help="how simulators are found; one that gives intervals")] = "gauss_newton",
    draws: Annotated[int, typer.Option(min=1, help="number of truths")] = 40,
    samples: Annotated[int, typer.Option(min=1, help="motions that each is tuned on")] = 5,
    seed: Annotated[int, typer.Option(min=0, help="equal seeds give equal numbers")] = 0,
) -> Answer:
    """Draw truths, simulate what sensors say of them, tune, and print how often intervals contain the truth.

    It says which tunables random motions would identify, before a robot is touched, and needs no service.
    """
    from gaplab.api.library.recovering import recover

    asked: dict[str, Any] = {"engine": engine, "tuner": tuner, "draws": draws, "samples": samples, "seed": seed}
    found = recover(robot, _labels(tunables), **asked)
    told = {"tunables": found.tunables, "sentences": found.sentences, "draws": len(found.draws), "samples": samples}
    return Answer(told, *shown(found.table), *found.sentences)


def _labels(text: str | None) -> list[str] | None:
    return None if text is None else re.split(r",\s*(?![^()]*\))", text)
