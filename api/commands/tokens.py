"""Commands that create, list and revoke tokens. They use the database directly, so that the first needs no token."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from gaplab.api.commands.app import OTHERS, Answer, AsJson, app, command
from gaplab.api.commands.json_output import echo
from gaplab.api.commands.tables import minute, table
from gaplab.schemas.access import Role, TokenRead
from gaplab.services.settings import Settings

if TYPE_CHECKING:
    from gaplab.services.store.session import Store

NONE_LEFT = "No token is left, and the service refuses every request; `gaplab token create --role admin` makes one."

tokens = typer.Typer(
    help="Manage the tokens that the service accepts, in the database of GAPLAB_DATABASE_URL.", no_args_is_help=True
)
app.add_typer(tokens, name="token", rich_help_panel=OTHERS)


@command(of=tokens)
def create(
    role: Annotated[Role, typer.Option(help="permissions: reader reads; runner also runs; admin also reveals reality")],
    name: Annotated[str | None, typer.Option(help="name of the user")] = None,
    as_json: AsJson = False,
) -> Answer:
    """Create a token, and print it this once: only its digest is stored. A new database gets its tables first."""
    from gaplab.api.process.service import migrate
    from gaplab.services import access

    migrate(Settings.from_environment().database_url, only_new=True)  # an older service may run on an existing one
    with _store() as store:
        made = access.create_token(store, role, name)
    if not as_json:
        echo(f"{made.token.id} ({made.token.name}, {role.value}); this is shown once, for GAPLAB_TOKEN:", err=True)
    return Answer({"token": made.token, "secret": made.secret}, made.secret)


@command(name="list", of=tokens)
def list_() -> Answer:
    """List the tokens, without their secrets."""
    from gaplab.services import access

    with _store() as store:
        found = access.list_tokens(store)
    columns = ("id", "name", "role", "created", "last used", "revoked")
    shown = table(columns, map(_row, found)) if found else "No tokens yet; `gaplab token create` makes one."
    return Answer(found, shown)


@command(of=tokens)
def revoke(id: Annotated[str, typer.Argument(metavar="ID", help="id of the token")]) -> Answer:
    """Revoke a token; the service refuses it from the next request on."""
    from gaplab.services import access

    with _store() as store:
        access.revoke_token(store, id)
        left = [token for token in access.list_tokens(store) if token.revoked_at is None]
    return Answer({"id": id, "revoked": True}, f"Revoked {id}.", notes=[] if left else [NONE_LEFT])


@contextmanager
def _store() -> Iterator["Store"]:
    from gaplab.services.store.session import Store

    with Store(Settings.from_environment().database_url) as store:
        store.check()
        yield store


def _row(token: TokenRead) -> tuple[str, ...]:
    moments = (token.created_at, token.last_used_at, token.revoked_at)
    return token.id, escape(token.name), token.role.value, *map(minute, moments)
