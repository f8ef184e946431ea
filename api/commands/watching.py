"""Watch what runs."""

from typing import Annotated

import typer

from gaplab.api.clients import display
from gaplab.api.clients.client import Client
from gaplab.api.clients.watch import follow
from gaplab.api.commands.base import AsJson, Id, Url, app, connect
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import document
from gaplab.api.commands.monitor import looks
from gaplab.api.commands.monitor import watch as show
from gaplab.api.commands.submitting import finish
from gaplab.schemas.records import ExperimentRead, StudyRead


@app.command()
def watch(
    id: Id,
    every: Annotated[float, typer.Option(min=0.1, max=3600, help="seconds between two looks")] = 1.0,
    patience: Annotated[float, typer.Option(min=0, help="seconds for which the service may be away")] = 600.0,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Watch a study or an experiment until it has ended: its curve and each repetition, live; in a log, lines."""
    with connect(url) as client:
        try:
            ended = _watched(client, id, every, patience, quiet=as_json)
        except KeyboardInterrupt:
            msg = f"it goes on without you; `gaplab watch {id}` looks at it again"
            raise CommandError(msg, Exit.INTERRUPTED) from None
    if as_json:
        document(ended)
    finish(ended, quiet=as_json)


def _watched(
    client: Client,
    id: str,
    every_s: float,
    patience_s: float,
    *,
    quiet: bool,
) -> ExperimentRead | StudyRead:
    console = display.console(stderr=quiet)
    if console.is_terminal:
        return show(looks(client, id, every_s=every_s, patience_s=patience_s), console)
    return follow(client.watch(id, every_s=every_s, patience_s=patience_s), console)
