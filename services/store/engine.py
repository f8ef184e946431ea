"""Database engines, with the settings on which durability and locking depend.

A connection to Postgres can die silently: a firewall forgets it, a cable is cut, a proxy hangs. The kernel notices the
first two if it is told to look. A proxy that hangs still accepts bytes: only a limit of the client's own helps.
"""

import re
import sqlite3
from collections.abc import Generator
from time import monotonic
from typing import Any, TypeVar

import psycopg
from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError

from gaplab.services.store import sqlite_file
from gaplab.services.store.database_errors import StoreUnavailable

T = TypeVar("T")

CONNECT_S = 5
"""Longest wait for a server to answer a connection, and grace of a client that waits for a statement's end."""

SILENT_TRANSACTION_S = 60
"""Seconds after which the server ends an idle transaction, as of a stopped process: it may hold locks."""

_NOTICED = {
    "connect_timeout": CONNECT_S,
    "keepalives": 1,
    "keepalives_idle": 10,
    "keepalives_interval": 5,
    "keepalives_count": 3,
    "tcp_user_timeout": 20_000,  # milliseconds
}
"""A dead peer is noticed after 25 s of silence, or 20 s after bytes that it did not acknowledge.

Source: https://www.postgresql.org/docs/current/libpq-connect.html.
"""


def postgres_engine(url: URL, *, answer_s: float | None) -> Engine:
    """Return an engine of a URL with its driver, without connecting; without `answer_s`, statements take any time."""
    engine = create_engine(
        url, pool_pre_ping=True, pool_size=10, max_overflow=20, connect_args=_NOTICED, hide_parameters=True
    )
    if answer_s is not None:
        _limit(engine, answer_s)
    return engine


def _limit(engine: Engine, answer_s: float) -> None:
    """End statements that take longer: the server does it, and the client if the server says nothing."""

    class Punctual(psycopg.Connection[Any]):
        """A connection whose statements end in time."""

        def wait(self, gen: Any, *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401  # psycopg's hook
            return super().wait(_in_time(self, gen, answer_s + CONNECT_S), *args, **kwargs)

    limits = f"SET statement_timeout = {round(answer_s * 1000)}; "
    limits += f"SET idle_in_transaction_session_timeout = {SILENT_TRANSACTION_S * 1000}"

    @event.listens_for(engine, "do_connect")
    def connect(dialect: object, record: object, args: Any, parameters: Any) -> Any:  # noqa: ANN401, ARG001  # SQLAlchemy's hook
        connection = Punctual.connect(*args, **parameters)
        try:
            connection.execute(limits)
            connection.commit()
        except BaseException:
            connection.close()
            raise
        return connection


def _in_time(
    connection: "psycopg.Connection[Any]", answers: Generator[Any, Any, T], limit_s: float
) -> Generator[Any, Any, T]:
    """Return what the server answers, and close the connection if the answer takes longer.

    Raises:
        OperationalError: the server was silent for too long; whether it did what it was asked is unknown.
    """
    until = monotonic() + limit_s
    try:
        wanted = next(answers)
        while True:
            ready = yield wanted
            if not ready and monotonic() > until:
                connection.pgconn.finish()
                msg = f"the server did not answer for {limit_s:g} s"
                raise psycopg.OperationalError(msg)
            wanted = answers.send(ready)
    except StopIteration as end:
        result: T = end.value
        return result


WRITES = "gaplab_writes"
"""Execution option of a connection whose transactions will write."""

HASTENS = "gaplab_hastens"
"""Execution option of a connection whose transactions fail rather than wait for another's lock, in SQLite."""

PATIENCE_S = 30
"""Longest wait of a transaction for another's lock, in SQLite."""

_INVALID = "the database URL is not valid; write one like sqlite:///gaplab.db or postgresql://user@host/db"
_PERCENT = "a SQLite URL has no options, and no letter as %41: in its path write ? as %3F and % as %25"
_MISREAD = re.compile(r"\?|%(00|3\d|[46][1-9a-f]|[57][\da])", re.IGNORECASE)
"""What a URL means otherwise than a path does: the beginning of options, NUL, and encoded letters and digits."""

_ENCODED = "in a user or a password write @ as %40, : as %3A, / as %2F and % as %25, or set PGPASSWORD instead"

_WAL_IS_SOUND = (3, 51, 3)
"""Before this, SQLite's write-ahead log can be corrupted when it is reset. Source: https://sqlite.org/wal.html.

The rollback journal is then kept and its header zeroed, which is synced before COMMIT returns. A deleted journal may
reappear after a power loss, and then undoes the last transaction. Source: https://sqlite.org/pragma.html, EXTRA.
"""


def open_engine(url: str, *, enforce_foreign_keys: bool = True, answer_s: float | None = None) -> Engine:
    """Return the engine of a SQLite or Postgres URL, without connecting.

    Its errors contain no values, since a logged spec would reveal reality's parameters.

    Args:
        url: SQLAlchemy URL; Postgres without a driver gets psycopg 3.
        enforce_foreign_keys: enforce them in SQLite; False in a migration that rebuilds tables.
        answer_s: longest time of a statement in Postgres; None for any time.

    Raises:
        StoreUnavailable: no such kind of database.
    """
    parsed = parse(url)
    if parsed.get_backend_name() == "postgresql":
        return postgres_engine(parsed, answer_s=answer_s)
    if file := sqlite_file.file_of(parsed):  # a link that leads elsewhere later does not lead connections there
        parsed = parsed.set(database=str(file))
    engine = create_engine(parsed, pool_pre_ping=True, connect_args={"timeout": PATIENCE_S}, hide_parameters=True)
    _prepare_sqlite(engine, enforce_foreign_keys=enforce_foreign_keys)
    return engine


def parse(url: str) -> URL:
    """Return a database URL with its driver.

    Raises:
        StoreUnavailable: it is not a URL, or of another kind of database; the message has no part of a password.
    """
    try:
        parsed = make_url(url)
    except ArgumentError as error:
        raise StoreUnavailable(_INVALID) from error
    except ValueError:  # whose message has a part of the URL, maybe of its password
        raise StoreUnavailable(f"{_INVALID}; {_ENCODED}") from None
    if "@" in (parsed.host or ""):
        raise StoreUnavailable(f"the host in the database URL has an '@'; {_ENCODED}")
    if parsed.drivername in {"postgres", "postgresql"}:
        return parsed.set(drivername="postgresql+psycopg")
    if parsed.get_backend_name() not in {"sqlite", "postgresql"}:
        raise StoreUnavailable(f"the database is {parsed.get_backend_name()!r}; it may be sqlite or postgresql")
    if parsed.get_backend_name() == "sqlite" and _MISREAD.search(url):
        raise StoreUnavailable(_PERCENT)
    return parsed


def _prepare_sqlite(engine: Engine, *, enforce_foreign_keys: bool) -> None:
    """Make SQLite durable, and let writers wait for each other.

    The driver's own BEGIN is deferred: a transaction that first reads and then writes would fail at once, without
    waiting. So the driver begins nothing, and a transaction that will write begins IMMEDIATE.
    """
    journal = "WAL" if sqlite3.sqlite_version_info >= _WAL_IS_SOUND else "PERSIST"
    if file := sqlite_file.file_of(engine.url):

        @event.listens_for(engine, "do_connect")
        def keep_private(*_: object) -> None:
            sqlite_file.create(file)

    @event.listens_for(engine, "connect")
    def configure(connection: Any, record: object) -> None:  # noqa: ANN401, ARG001  # SQLAlchemy's hook
        connection.isolation_level = None
        connection.execute(f"PRAGMA journal_mode={journal}")
        connection.execute("PRAGMA synchronous=FULL")
        connection.execute("PRAGMA temp_store=MEMORY")  # large sorts and indices need no folder that can be written
        connection.execute(f"PRAGMA foreign_keys={'ON' if enforce_foreign_keys else 'OFF'}")

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        options = connection.get_execution_options()
        patience_ms = 0 if options.get(HASTENS) else PATIENCE_S * 1_000
        connection.connection.cursor().execute(f"PRAGMA busy_timeout={patience_ms}")
        connection.exec_driver_sql("BEGIN IMMEDIATE" if options.get(WRITES) else "BEGIN")
