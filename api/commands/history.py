"""What happened, and under what."""

from collections.abc import Iterable
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

from gaplab.api.clients import display
from gaplab.api.commands import completion
from gaplab.api.commands.base import AsJson, ExperimentId, Url, app, connect
from gaplab.api.commands.json_output import document
from gaplab.schemas.events import EventKind, EventRead
from gaplab.schemas.provenance import ProvenanceRead
from gaplab.schemas.records import StudyRead


@app.command()
def events(
    id: Annotated[
        str | None,
        typer.Argument(metavar="[ID]", help="of a study or an experiment", autocompletion=completion.ids),
    ] = None,
    follow: Annotated[bool, typer.Option("--follow", help="go on with what happens, for ever")] = False,
    kind: Annotated[list[EventKind] | None, typer.Option(help="only of this kind; repeat it for several")] = None,
    after: Annotated[int, typer.Option(min=0, help="number of the last event that is known")] = 0,
    as_json: Annotated[
        bool, typer.Option("--json", help="print one JSON document; with --follow, one in each line")
    ] = False,
    url: Url = None,
) -> None:
    """Print what happened to an experiment, a study, or all of them: a line an event."""
    with connect(url) as client:
        found = client.find(id) if id else None
        of = {"study" if isinstance(found, StudyRead) else "experiment": found.id} if found else {}
        kinds = [each.value for each in kind or []]
        _print(client.events(follow=follow, kind=kinds, after=after, **of), as_json=as_json, follow=follow)


@app.command("accept-versions")
def accept_versions(
    id: ExperimentId,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Let an experiment go on under other engines or plug-ins than it was begun with."""
    with connect(url) as client:
        found = client.accept_versions(id)
    if as_json:
        document(found)
        return
    typer.echo(f"{found.id} goes on under the versions of the next supervisor.")


def print_provenance(found: ProvenanceRead, console: Console) -> None:
    """Under what an experiment was computed, a line each time that it changed."""
    for each in found.uses:
        under = each.provenance
        commit = f", commit {under.commit[:8]}{' and changes' if under.dirty else ''}" if under.commit else ""
        engines = ", ".join(f"{name} ({library})" for name, library in under.engines.items())
        software = f"gaplab {under.gaplab}{commit}, Python {under.python}, {engines}"
        console.print(f"computed with {software}; {under.processor}, {under.system}", markup=False, soft_wrap=True)


def _print(found: Iterable[EventRead], *, as_json: bool, follow: bool) -> None:
    """A line an event, as they come; or, if they end, one document."""
    if as_json and not follow:
        document(found)
        return
    console = display.console()
    for each in found:
        if as_json:
            document(each, line=True)
        else:
            console.print(_line(each), soft_wrap=True)


def _line(event: EventRead) -> str:
    """An event in a line."""
    where = event.experiment if event.repetition is None else f"{event.experiment}/{event.repetition}"
    told = ", ".join(f"{name} {_short(value)}" for name, value in event.body.items())
    when = event.at.astimezone().strftime("%Y-%m-%d %H:%M:%S")
    return f"{event.number:>7} {when} {where} [bold]{event.kind}[/] {escape(told)}".rstrip()


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "none" if value is None else str(value)
