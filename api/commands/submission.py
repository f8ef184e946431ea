"""Commands that submit a spec."""

from typing import Annotated

import typer

from gaplab.api.clients.progress.text import console
from gaplab.api.commands import tables
from gaplab.api.commands.app import AsJson, SpecFile, Url, app, connect
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import print_json
from gaplab.api.commands.progress import print_ending, show_progress
from gaplab.api.commands.spec_files import read_spec
from gaplab.schemas.lifecycle import State


@app.command()
def submit(
    spec: SpecFile,
    watch: Annotated[bool, typer.Option("--watch", help="show the progress until it ends")] = False,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Submit an experiment, or a study if the spec names several strategies or none."""
    with connect(url) as client:
        record = client.submit(read_spec(spec))
        if not as_json:
            typer.echo(record.id)
        if watch:
            record = show_progress(client, record.id, quiet=as_json)
    if as_json:
        print_json(record)
    if watch:
        print_ending(record, quiet=as_json)


@app.command()
def sensitivity(spec: SpecFile, as_json: AsJson = False, url: Url = None) -> None:
    """Check the tunables of a spec: whether they change fitness, how much, and how smoothly."""
    with connect(url) as client:
        check = client.check(read_spec(spec))
    if as_json:
        print_json(check)
    if check.state is not State.COMPLETED:
        msg = f"the check {check.id} ended as {check.state}: {check.reason}"
        raise CommandError(msg, Exit.FAILED)
    if not as_json:
        console().print(tables.sensitivity(check))
        for warning in check.warnings:
            typer.echo(warning)
