"""Statements and values that SQLite and Postgres want written differently."""

from collections.abc import Callable

from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from gaplab.services.store.models import Base
from gaplab.services.store.texts import storable as storable

_INSERT: dict[str, Callable[..., postgresql.Insert | sqlite.Insert]] = {
    "sqlite": sqlite.insert,
    "postgresql": postgresql.insert,
}


def insert_new(session: Session, table: type[Base]) -> postgresql.Insert | sqlite.Insert:
    """Return an INSERT that leaves rows alone whose key is there already."""
    return _INSERT[session.get_bind().dialect.name](table).on_conflict_do_nothing()
