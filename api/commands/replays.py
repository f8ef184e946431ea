"""The command that replays a controller."""

from pathlib import Path
from typing import Annotated

import typer

from gaplab.api.clients.replays import FORMATS
from gaplab.api.commands.app import RESULTS, AsJson, ExperimentId, Url, app, connect
from gaplab.api.commands.figures import named_option
from gaplab.api.commands.json_output import print_json
from gaplab.schemas.replays import ReplayWorld


@app.command(rich_help_panel=RESULTS)
def replay(
    id: ExperimentId,
    save: Annotated[
        Path | None, typer.Option("--save", "-o", help=f"file; its suffix is the format: {', '.join(FORMATS)}")
    ] = None,
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
    """Replay a controller in its simulator and in reality, and save it as a video."""
    if save and save.suffix.removeprefix(".").lower() not in FORMATS:
        raise typer.BadParameter(
            f"{save} has no suffix of a video; permitted: {', '.join(FORMATS)}", param_hint="--save"
        )
    with connect(url) as client:
        choice = dict(map(named_option, options or []))
        found = client.replay(id, **choice)
        file = client.video(id, save, **choice) if save else None
    if as_json:
        print_json(found)
    else:
        for name, world in (("in its simulator", found.simulation), ("in reality", found.reality)):
            typer.echo(f"{name}: {_told(world, found.unit)}")
    if file:
        typer.echo(f"Wrote {file}.", err=as_json)


def _told(world: ReplayWorld | None, unit: str) -> str:
    if world is None:
        return "not shown"
    return "the physics failed" if world.fitness is None else f"{world.fitness:.3f} {unit}, {world.engine}"
