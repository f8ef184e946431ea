"""The commands for reports and replays, and for what one takes home from a bench."""

from pathlib import Path
from typing import Annotated

import typer

from gaplab.api.commands.app import BENCH, RESULTS, AsJson, ExperimentId, Id, Url, app, connect
from gaplab.api.commands.comparisons import MarginOption, margins
from gaplab.api.commands.figures import named_option
from gaplab.api.commands.json_output import echo, print_result
from gaplab.schemas.replays import ReplayWorld


@app.command(rich_help_panel=RESULTS)
def report(
    id: Id,
    save: Annotated[Path | None, typer.Option("--save", "-o", help="file with the suffix .html")] = None,
    margin: MarginOption = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Print the verdict on a study, or save its report: figures, tables, tests, provenance."""
    width, share = margins(margin)
    with connect(url) as client:
        verdict = client.verdict(id, margin=width, margin_of_direct=share)
        file = client.report(id, save, margin=width, margin_of_direct=share) if save else None
    sentences = () if file else verdict.sentences
    print_result(verdict, verdict.headline, *(f"- {each}" for each in sentences), as_json=as_json)
    if file:
        echo(f"Wrote {file}.", err=as_json)


@app.command(rich_help_panel=BENCH)
def takehome(
    id: Annotated[str, typer.Argument(metavar="ID", help="an experiment")],
    file: Annotated[
        Path | None,
        typer.Argument(help="file with the suffix .zip; default: gaplab-ID-takehome.zip", show_default=False),
    ] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Save what one takes home: the best controller, its motion, the tuned simulator, and the report."""
    file = file or Path(f"gaplab-{id}-takehome.zip")
    with connect(url) as client:
        written = client.take_home(id, file)
    document = {"file": str(written), "bytes": written.stat().st_size}
    print_result(document, f"Wrote {written}.", as_json=as_json)


@app.command(rich_help_panel=RESULTS)
def replay(
    id: ExperimentId,
    options: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            "-s",
            metavar="NAME=VALUE",
            help="repetition, iteration (left out: the last), kind (transfer or sample), simulator; repeatable",
        ),
    ] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Replay a controller in its simulator and in reality: print its fitness, or with --json its motion."""
    with connect(url) as client:
        found = client.replay(id, **dict(map(named_option, options or [])))
    worlds = (("in its simulator", found.simulation), ("in reality", found.reality))
    print_result(found, *(f"{name}: {_result_in(world, found.unit)}" for name, world in worlds), as_json=as_json)


def _result_in(world: ReplayWorld | None, unit: str) -> str:
    if world is None:
        return "not shown"
    return "the physics failed" if world.fitness is None else f"{world.fitness:.3f} {unit}, {world.engine}"
