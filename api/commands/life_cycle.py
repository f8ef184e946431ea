"""Pause, resume, stop, call off, extend."""

from typing import Annotated

import typer

from api.commands.base import Id, Url, app, connect
from schemas.records import ExperimentRead, StudyRead

Total = typer.Option(min=1, help="in all, not what is added; left out: as many as there are")


@app.command()
def pause(id: Id, url: Url = None) -> None:  # noqa: A002 - as the API says
    """Let an experiment or a study finish the steps under way and give its cores back, until it is resumed."""
    with connect(url) as client:
        _say(client.pause(id))


@app.command()
def resume(id: Id, url: Url = None) -> None:  # noqa: A002 - as the API says
    """Go on with an experiment or a study that was paused."""
    with connect(url) as client:
        _say(client.resume(id))


@app.command()
def stop(id: Id, url: Url = None) -> None:  # noqa: A002 - as the API says
    """Let an experiment or a study finish the steps under way, and complete it with what is there."""
    with connect(url) as client:
        _say(client.stop(id))


@app.command()
def cancel(id: Id, url: Url = None) -> None:  # noqa: A002 - as the API says
    """Call an experiment off, or all of a study that has not ended; what is stored stays."""
    with connect(url) as client:
        typer.echo(f"Cancelled {client.cancel(id).name}.")


@app.command()
def extend(
    id: Id,  # noqa: A002 - as the API says
    iterations: Annotated[int | None, Total] = None,
    repetitions: Annotated[int | None, Total] = None,
    url: Url = None,
) -> None:
    """Add iterations or repetitions to a completed experiment; what is there stands."""
    with connect(url) as client:
        _say(client.extend(id, iterations=iterations, repetitions=repetitions))


def _say(found: ExperimentRead | StudyRead) -> None:
    typer.echo(f"{found.name} is {found.state}.")
