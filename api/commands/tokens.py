"""Make, list and revoke tokens. These commands work on the database itself, so that the first needs none."""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from typing import Annotated

import typer
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from gaplab.api.clients import display
from gaplab.api.commands.base import AsJson, app
from gaplab.api.commands.json_output import document
from gaplab.schemas.access import Role
from gaplab.services import access
from gaplab.services.settings import Settings
from gaplab.services.store.session import Store

tokens = typer.Typer(
    help="Tokens that the service lets in; on the database of GAPLAB_DATABASE_URL.", no_args_is_help=True
)
app.add_typer(tokens, name="token")


@tokens.command()
def create(
    role: Annotated[Role, typer.Option(help="what it permits: reading; running too; revealing reality too")],
    name: Annotated[str | None, typer.Option(help="of whoever will use it", show_default=False)] = None,
    as_json: AsJson = False,
) -> None:
    """Make a token, and print it this once: only its digest is stored."""
    from gaplab.api.process.service import migrate

    migrate(Settings.from_environment().database_url)
    with _store() as store:
        made = access.create_token(store, role, name)
    if as_json:
        document({"token": made.token, "secret": made.secret})
        return
    typer.echo(f"{made.token.id} ({made.token.name}, {role.value}); this is shown once, for GAPLAB_TOKEN:", err=True)
    typer.echo(made.secret)


@tokens.command("list")
def list_(as_json: AsJson = False) -> None:
    """List the tokens, without their secrets."""
    with _store() as store:
        found = access.list_tokens(store)
    if as_json:
        document(found)
        return
    table = Table("id", "name", "role", "made", "last used", "revoked", box=SIMPLE_HEAD)
    for each in found:
        moments = map(_minute, (each.created_at, each.last_used_at, each.revoked_at))
        table.add_row(each.id, escape(each.name), each.role.value, *moments)
    display.console().print(table if found else "No tokens yet; `gaplab token create` makes one.")


@tokens.command()
def revoke(
    id: Annotated[str, typer.Argument(metavar="ID", help="as listed")],
    as_json: AsJson = False,
) -> None:
    """Revoke a token; it admits nobody from the next request on."""
    with _store() as store:
        access.revoke_token(store, id)
    if as_json:
        document({"id": id, "revoked": True})
        return
    typer.echo(f"Revoked {id}.")


@contextmanager
def _store() -> Iterator[Store]:
    store = Store(Settings.from_environment().database_url)
    try:
        store.check()
        yield store
    finally:
        store.dispose()


def _minute(moment: datetime | None) -> str:
    return moment.astimezone().strftime("%Y-%m-%d %H:%M") if moment else ""
