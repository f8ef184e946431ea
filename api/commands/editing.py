"""Change names and notes."""

from typing import Annotated

import typer

from api.commands.base import AsJson, Id, Url, app, connect
from api.document import document
from schemas.editing import Edit


@app.command()
def edit(
    id: Id,  # noqa: A002 - as the API says
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
        edited = client.edit(id, Edit.model_validate(changes))
    if as_json:
        document(edited)
        return
    typer.echo(f"{edited.id}: {edited.name}" + (f" ({edited.notes})" if edited.notes else ""))
