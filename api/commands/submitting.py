"""Submit experiments and studies."""

from typing import Annotated

import typer

from api import display
from api.client import Client
from api.commands.base import Url, app, connect, experiments_of, print_warnings
from api.exits import CommandError, Exit
from api.files import read_spec
from api.watch import follow
from schemas.lifecycle import State
from schemas.records import ExperimentRead, StudyRead


@app.command()
def submit(
    spec: Annotated[str, typer.Argument(metavar="SPEC", help="a JSON file, or - to read standard input")],
    watch: Annotated[bool, typer.Option("--watch", help="stay, and show the progress")] = False,
    url: Url = None,
) -> None:
    """Submit an experiment, or a study if the spec names several strategies or none."""
    with connect(url) as client:
        submitted = client.submit(read_spec(spec))
        console = display.console()
        console.print(submitted.id, markup=False)
        if watch:
            _finish(_watched(client, submitted.id))


def _watched(client: Client, id: str) -> ExperimentRead | StudyRead:  # noqa: A002 - as the API says
    try:
        return follow(client.watch(id), display.console())
    except KeyboardInterrupt:
        msg = f"it goes on without you; `gaplab show {id}` says how far it is"
        raise CommandError(msg, Exit.INTERRUPTED) from None


def _finish(ended: ExperimentRead | StudyRead) -> None:
    """Say how it ended; a failure is one for the shell as well."""
    typer.echo(f"{ended.name}: {ended.state}; {display.numbers(ended.progress)}.")
    reasons = {reason for each in experiments_of(ended) for reason in each.reasons}
    for reason in sorted(reasons):
        typer.echo(f"  {reason}", err=True)
    print_warnings(experiments_of(ended))
    if ended.state is not State.COMPLETED:
        raise typer.Exit(Exit.FAILED)
