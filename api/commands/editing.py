"""Change names and notes."""

from collections.abc import Mapping
from typing import Annotated

import typer
from pydantic import ValidationError

from gaplab.api.commands.base import AsJson, Id, Url, app, connect
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import document
from gaplab.schemas.editing import Edit


@app.command()
def edit(
    id: Id,
    name: Annotated[str | None, typer.Option(help="a new name", show_default=False)] = None,
    notes: Annotated[str | None, typer.Option(help="new notes; empty takes them away", show_default=False)] = None,
    as_json: AsJson = False,
    url: Url = None,
) -> None:
    """Give a study or an experiment another name, or notes."""
    changes = {"name": name} if name is not None else {}
    if notes is not None:
        changes["notes"] = notes or None
    with connect(url) as client:
        edited = client.edit(id, _checked(changes))
    if as_json:
        document(edited)
        return
    typer.echo(f"{edited.id}: {edited.name}" + (f" ({edited.notes})" if edited.notes else ""))


def _checked(changes: Mapping[str, str | None]) -> Edit:
    try:
        return Edit.model_validate(changes)
    except ValidationError as error:
        wrong = (_sentence(each["loc"], each["msg"]) for each in error.errors())
        raise CommandError("; ".join(wrong), Exit.INVALID) from error


def _sentence(place: tuple[int | str, ...], message: str) -> str:
    said = message.removeprefix("Value error, ")
    return f"--{place[0]}: {said}" if place else said
