"""The store: transactions on one database, and the one place where its troubles become `StoreUnavailable`."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from sqlalchemy import text
from sqlalchemy.exc import DatabaseError, DBAPIError, InterfaceError, OperationalError
from sqlalchemy.exc import TimeoutError as PoolExhausted
from sqlalchemy.orm import Session, sessionmaker

from services.core.errors import StoreUnavailable
from services.store.engine import WRITES, open_engine
from services.store.models import REVISION

T = TypeVar("T")

_CLASHES = {"40001", "40P01"}
"""Postgres gave up one of two transactions for the other: serialization failure, deadlock."""

_NO_SCHEMA = {"42P01", "42703"}
"""Postgres knows no such table, or no such column."""

_TRIES = 5


class Store:
    """One database, SQLite or Postgres; safe to share between threads, and opened without connecting.

    It recovers by itself: a connection that died is replaced at its next use.
    """

    def __init__(self, url: str) -> None:
        self._engine = open_engine(url)
        snapshot = {"isolation_level": "REPEATABLE READ"} if self._engine.name == "postgresql" else {}
        self._writer = sessionmaker(self._engine.execution_options(**{WRITES: True}), expire_on_commit=False)
        self._reader = sessionmaker(self._engine.execution_options(**snapshot), expire_on_commit=False)

    @contextmanager
    def transaction(self) -> Iterator[Session]:
        """A session that may write: all of it is committed at the end, or none of it.

        Raises:
            StoreUnavailable: the database cannot be used now.
        """
        with _troubles_named(), self._writer.begin() as session:
            yield session

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """A session for a few reads of one moment; keep it short, for in SQLite it holds up whoever writes.

        Raises:
            StoreUnavailable: the database cannot be used now.
        """
        with _troubles_named(), self._reader.begin() as session:
            yield session

    def write(self, work: Callable[[Session], T]) -> T:
        """What `work` returns from a transaction of its own; run anew when Postgres gave it up for another.

        Raises:
            StoreUnavailable: the database cannot be used now.
        """
        for attempt in range(_TRIES):
            try:
                with self._writer.begin() as session:
                    return work(session)
            except DBAPIError as error:
                if _sqlstate(error) not in _CLASHES or attempt == _TRIES - 1:
                    with _troubles_named():
                        raise
            time.sleep(0.01 * 2**attempt)
        raise AssertionError

    def check(self) -> None:
        """Do nothing if the database is there and its schema is the one this version needs.

        Raises:
            StoreUnavailable: it is not; the message says which and what to do.
        """
        with self.reading() as session:
            revisions = session.scalars(text("SELECT version_num FROM alembic_version")).all()
        if list(revisions) != [REVISION]:
            found = ", ".join(revisions) or "none"
            msg = f"the database is at revision {found}, this version needs {REVISION}: run `python -m migrations`"
            raise StoreUnavailable(msg)

    def dispose(self) -> None:
        """Close the idle connections; the store may be used again."""
        self._engine.dispose()


@contextmanager
def _troubles_named() -> Iterator[None]:
    try:
        yield
    except PoolExhausted as error:
        msg = "all connections to the database are in use"
        raise StoreUnavailable(msg) from error
    except DBAPIError as error:
        if _sqlstate(error) in _NO_SCHEMA or "no such table: alembic_version" in str(error.orig):
            msg = "the database has not the schema of this version: run `python -m migrations`"
            raise StoreUnavailable(msg) from error
        if isinstance(error, OperationalError | InterfaceError) or type(error) is DatabaseError:
            msg = f"the database cannot be used now: {_first_line(error)}"
            raise StoreUnavailable(msg) from error
        raise


def _sqlstate(error: DBAPIError) -> str | None:
    return getattr(error.orig, "sqlstate", None)


def _first_line(error: DBAPIError) -> str:
    return (str(error.orig).splitlines() or [type(error.orig).__name__])[0]
