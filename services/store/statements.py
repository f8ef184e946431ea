"""Statements that differ between SQLite and Postgres, and the look-up of a row by a key that people write."""

from collections.abc import Callable
from typing import Any, TypeVar

from sqlalchemy import text
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from gaplab.services.core.errors import NotFound
from gaplab.services.store.models import Base
from gaplab.services.store.texts import storable as storable

R = TypeVar("R", bound=Base)

_INSERT: dict[str, Callable[..., postgresql.Insert | sqlite.Insert]] = {
    "sqlite": sqlite.insert,
    "postgresql": postgresql.insert,
}


def insert_new(session: Session, table: type[Base]) -> postgresql.Insert | sqlite.Insert:
    """Return an INSERT that skips rows whose key exists already."""
    return _INSERT[session.get_bind().dialect.name](table).on_conflict_do_nothing()


def wait_for_others(session: Session, lock: int) -> None:
    """Wait until no other transaction has this lock of Postgres; in SQLite no two transactions that write overlap."""
    if session.get_bind().dialect.name == "postgresql":
        session.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": lock})


def existing(session: Session, table: type[R], key: str, noun: str, **how: Any) -> R:  # noqa: ANN401 - as `Session.get`
    """Return the row with a key.

    Raises:
        NotFound: there is none; the message has the noun.
    """
    if (found := session.get(table, storable(key), **how)) is None:
        raise NotFound(f"there is no {noun} {key!r}")
    return found
