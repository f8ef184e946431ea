"""Statements and values that differ between SQLite and Postgres."""

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
    """Return an INSERT that skips rows whose key exists already."""
    return _INSERT[session.get_bind().dialect.name](table).on_conflict_do_nothing()
