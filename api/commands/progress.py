"""The command that shows the progress of what runs."""

from typing import Annotated

import typer

from gaplab.api.clients.client import Client
from gaplab.api.clients.progress.text import console, counts
from gaplab.api.clients.records import Record, experiments_of
from gaplab.api.commands.app import AsJson, Id, Url, app, connect, print_warnings
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import print_json
from gaplab.schemas.lifecycle import State


@app.command()
def watch(
    id: Id,
    every: Annotated[float, typer.Option(min=0.1, max=3600, help="seconds between requests")] = 1.0,
    patience: Annotated[float, typer.Option(min=0, help="longest time in seconds without a service")] = 600.0,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Watch a study or an experiment until it ends: live curves and repetitions in a terminal, lines in a log."""
    with connect(url) as client:
        record = show_progress(client, id, quiet=as_json, curves=True, every_s=every, patience_s=patience)
    if as_json:
        print_json(record)
    print_ending(record, quiet=as_json)


def show_progress(
    client: Client, id: str, *, quiet: bool, curves: bool = False, every_s: float = 1.0, patience_s: float = 60.0
) -> Record:
    """Show the progress until the end, on standard error if quiet; return the last record."""
    try:
        screen = console(stderr=quiet)
        return client.watcher.show(id, screen, curves=curves, every_s=every_s, patience_s=patience_s)
    except KeyboardInterrupt:
        msg = f"it continues on the service; `gaplab watch {id}` shows it again"
        raise CommandError(msg, Exit.INTERRUPTED) from None


def print_ending(record: Record, *, quiet: bool) -> None:
    """Print the result, unless quiet, with reasons and warnings; exit with an error if it did not complete."""
    if not quiet:
        typer.echo(f"{record.name}: {record.state}; {counts(record.progress)}.")
    for reason in sorted({reason for experiment in experiments_of(record) for reason in experiment.reasons}):
        typer.echo(f"  {reason}", err=True)
    print_warnings(record)
    if record.state is not State.COMPLETED:
        raise typer.Exit(Exit.FAILED)
