"""Pause, resume, stop, call off, extend."""

from typing import Annotated

import typer

from gaplab.api.commands.base import AsJson, ExperimentId, Id, Url, app, connect
from gaplab.api.commands.json_output import document
from gaplab.schemas.records import ExperimentRead, StudyRead

Total = typer.Option(min=1, help="in all, not what is added; left out: as many as there are")


@app.command()
def pause(id: Id, as_json: AsJson = False, url: Url = None) -> None:
    """Let an experiment or a study finish the steps under way and give its cores back, until it is resumed."""
    with connect(url) as client:
        _say(client.pause(id), as_json=as_json)


@app.command()
def resume(id: Id, as_json: AsJson = False, url: Url = None) -> None:
    """Go on with an experiment or a study that was paused."""
    with connect(url) as client:
        _say(client.resume(id), as_json=as_json)


@app.command()
def stop(id: Id, as_json: AsJson = False, url: Url = None) -> None:
    """Let an experiment or a study finish the steps under way, and complete it with what is there."""
    with connect(url) as client:
        _say(client.stop(id), as_json=as_json)


@app.command()
def cancel(id: Id, as_json: AsJson = False, url: Url = None) -> None:
    """Call an experiment off, or all of a study that has not ended; what is stored stays."""
    with connect(url) as client:
        _say(client.cancel(id), as_json=as_json)


@app.command()
def extend(
    id: ExperimentId,
    iterations: Annotated[int | None, Total] = None,
    repetitions: Annotated[int | None, Total] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Add iterations or repetitions to a completed experiment; what is there stands."""
    with connect(url) as client:
        _say(client.extend(id, iterations=iterations, repetitions=repetitions), as_json=as_json)


def _say(found: ExperimentRead | StudyRead, *, as_json: bool) -> None:
    if as_json:
        document(found)
        return
    typer.echo(f"{found.name} is {found.state}.")
