"""The one place where errors of a database become `StoreUnavailable`; programming errors pass through."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy.exc import DatabaseError, DBAPIError, InterfaceError, OperationalError
from sqlalchemy.exc import TimeoutError as PoolExhausted

from gaplab.services.core.errors import GaplabError

_DAMAGED = {sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB}

_CLASHES = {"40001", "40P01"}
"""Postgres aborted one of two conflicting transactions: serialization failure, deadlock."""

_NO_SCHEMA = {"42P01", "42703"}
"""Postgres knows no such table, or no such column."""

WRONG_SCHEMA = "the database lacks the schema of this version: run `python -m migrations`"


class StoreUnavailable(GaplabError):
    """The database is not usable now."""

    kind, title = "store-unavailable", "The database is unavailable"
    retry_after_s = 5


class StoreChanged(StoreUnavailable):
    """The database is no longer the one that the process knows, or has another schema; only a new process may go on."""


class StoreDamaged(StoreUnavailable):
    """The file of the database is damaged; the message says what to do."""


class Unsupported(GaplabError):
    """This kind of database does not support the request; the message names an alternative."""


@contextmanager
def named() -> Iterator[None]:
    """Turn errors of the database into one sentence without its password.

    Raises:
        StoreUnavailable: the database is unreachable, locked for too long, or has another schema.
        StoreDamaged: SQLite found the file damaged, or not a database.
    """
    try:
        yield
    except PoolExhausted as error:
        raise StoreUnavailable("all connections to the database are in use") from error
    except DBAPIError as error:
        if _sqlstate(error) in _NO_SCHEMA or str(error.orig).startswith(("no such table", "no such column")):
            raise StoreUnavailable(WRONG_SCHEMA) from error
        if is_damage(error.orig):
            raise StoreDamaged(f"the database is damaged: {_first_line(error)}") from error
        unusable = isinstance(error, OperationalError | InterfaceError) or type(error) is DatabaseError
        if unusable or error.connection_invalidated:
            raise StoreUnavailable(f"the database cannot be used now: {_first_line(error)}") from error
        raise


def is_damage(error: BaseException | None) -> bool:
    """Return whether SQLite found a file damaged, or not a database at all."""
    return getattr(error, "sqlite_errorcode", 0) & 0xFF in _DAMAGED  # the low byte is the kind of error


def is_clash(error: DBAPIError) -> bool:
    """Return whether the transaction was aborted for another one, and may succeed if it runs again."""
    return _sqlstate(error) in _CLASHES


def _sqlstate(error: DBAPIError) -> str | None:
    return getattr(error.orig, "sqlstate", None)


def _first_line(error: DBAPIError) -> str:
    return (str(error.orig).splitlines() or [type(error.orig).__name__])[0]
