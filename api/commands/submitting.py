"""Submit experiments and studies."""

from typing import Annotated

import typer

from gaplab.api.clients import display
from gaplab.api.clients.client import Client
from gaplab.api.clients.watch import follow
from gaplab.api.commands.base import AsJson, Url, app, connect, experiments_of, print_warnings
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import document
from gaplab.api.commands.spec_files import read_spec
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import ExperimentRead, StudyRead


@app.command()
def submit(
    spec: Annotated[str, typer.Argument(metavar="SPEC", help="a JSON file, or - to read standard input")],
    watch: Annotated[bool, typer.Option("--watch", help="stay, and show the progress")] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Submit an experiment, or a study if the spec names several strategies or none."""
    with connect(url) as client:
        submitted = client.submit(read_spec(spec))
        if not as_json:
            typer.echo(submitted.id)
        ended = watched(client, submitted.id, quiet=as_json) if watch else submitted
    if as_json:
        document(ended)
    if watch:
        finish(ended, quiet=as_json)


def watched(client: Client, id: str, *, quiet: bool) -> ExperimentRead | StudyRead:
    """What it ended as, after its progress was shown; if quiet, on standard error."""
    try:
        return follow(client.watch(id), display.console(stderr=quiet))
    except KeyboardInterrupt:
        msg = f"it goes on without you; `gaplab show {id}` says how far it is"
        raise CommandError(msg, Exit.INTERRUPTED) from None


def finish(ended: ExperimentRead | StudyRead, *, quiet: bool) -> None:
    """Say how it ended, unless quiet; a failure is one for the shell as well."""
    if not quiet:
        typer.echo(f"{ended.name}: {ended.state}; {display.numbers(ended.progress)}.")
    reasons = {reason for each in experiments_of(ended) for reason in each.reasons}
    for reason in sorted(reasons):
        typer.echo(f"  {reason}", err=True)
    print_warnings(experiments_of(ended))
    if ended.state is not State.COMPLETED:
        raise typer.Exit(Exit.FAILED)
