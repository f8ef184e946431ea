"""The command that prints events."""

from typing import Annotated

import typer
from rich.markup import escape

from gaplab.api.clients.screen import console
from gaplab.api.commands import completion
from gaplab.api.commands.app import SPECS, Url, app, connect
from gaplab.api.commands.json_output import print_json
from gaplab.schemas.events import EventKind, EventRead


@app.command(rich_help_panel=SPECS)
def events(
    id: Annotated[
        str | None, typer.Argument(metavar="[ID]", help="a study or an experiment", autocompletion=completion.ids)
    ] = None,
    follow: Annotated[bool, typer.Option("--follow", help="continue forever with new events")] = False,
    kind: Annotated[list[EventKind] | None, typer.Option(help="only this kind; repeatable")] = None,
    after: Annotated[int, typer.Option(min=0, help="number of the last event that is already known")] = 0,
    as_json: Annotated[
        bool, typer.Option("--json", help="print one JSON document; with --follow, one on each line")
    ] = False,
    url: Url = None,
) -> None:
    """Print the events of a study, or of the whole service, one on each line."""
    with connect(url) as client:
        found = client.events(follow=follow, study=id, kind=[each.value for each in kind or []], after=after)
        if as_json and not follow:
            print_json(found)
            return
        screen = console()
        for event in found:
            if as_json:
                print_json(event, line=True)
            else:
                screen.print(_line(event), soft_wrap=True)


def _line(event: EventRead) -> str:
    when = event.at.astimezone().strftime("%Y-%m-%d %H:%M:%S")
    return f"{event.number:>7} {when} {event.experiment} {escape(event.sentence)}"
