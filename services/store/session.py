"""The store: transactions on one database."""

import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from functools import cache, wraps
from pathlib import Path
from typing import Concatenate, ParamSpec, Self, TypeVar

from sqlalchemy import event, text
from sqlalchemy.dialects import sqlite as sqlite_dialect
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import Session as Session
from sqlalchemy.orm import sessionmaker
from sqlalchemy.schema import CreateIndex, CreateTable, DDLElement

from gaplab.services.store import database_errors
from gaplab.services.store.database_errors import StoreDamaged, StoreUnavailable
from gaplab.services.store.engine import HASTENS, WRITES, open_engine
from gaplab.services.store.models import REVISION, Base
from gaplab.services.store.models.base import other_schema
from gaplab.services.store.queries import events
from gaplab.services.store.sqlite_file import Guard, create, file_of

P = ParamSpec("P")
T = TypeVar("T")

_TRIES = 5

ANSWER_S = 60.0
"""Longest time of a statement in Postgres."""


class Store:
    """One SQLite or Postgres database; safe to share between threads, and opened without connecting.

    It recovers by itself: a connection that died is replaced at its next use, and one that says nothing is closed.

    Args:
        url: of the database.
        answer_s: longest time of a statement in Postgres.
        pinned: whether a file that replaces the database, or another schema, is refused for good, as by a supervisor,
            whose claims would be void; else the new file is opened.

    Attributes:
        file: of a SQLite database; None for Postgres.
        errors: number of times that the database could not be used.
        retries: number of transactions that Postgres aborted for others, and that ran again.
        unwritten: why the latest transaction that writes failed; None if it did not.
    """

    def __init__(self, url: str, *, answer_s: float = ANSWER_S, pinned: bool = False) -> None:
        self.errors = self.retries = 0
        self.unwritten: str | None = None
        self._engine = open_engine(url, answer_s=answer_s)
        self._guard = Guard(self._engine, pinned=pinned)
        self.file = file_of(self._engine.url)
        snapshot = {"isolation_level": "REPEATABLE READ"} if self._engine.name == "postgresql" else {}
        self._writer = sessionmaker(self._engine.execution_options(**{WRITES: True}), expire_on_commit=False)
        event.listen(self._writer, "before_commit", events.write)
        self._hasty = self._engine.execution_options(**{WRITES: True, HASTENS: True})
        self._reader = sessionmaker(self._engine.execution_options(**snapshot), expire_on_commit=False)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.dispose()

    @contextmanager
    def transaction(self) -> Iterator[Session]:
        """Open a session that may write; at the end, all of it is committed, or nothing.

        Raises:
            StoreUnavailable: the database cannot be used now.
        """
        with self._counting_errors(writes=True), self._writer.begin() as session:
            yield session

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """Open a session that reads a snapshot of the database; keep it short, since it delays writers in SQLite.

        Raises:
            StoreUnavailable: the database cannot be used now.
        """
        with self._counting_errors(), self._reader.begin() as session:
            yield session

    def write(self, work: Callable[Concatenate[Session, P], T], /, *args: P.args, **kwargs: P.kwargs) -> T:
        """Return `work(session, *args, **kwargs)`, run in a separate transaction.

        The transaction runs again if Postgres aborted it for another one.

        Raises:
            StoreUnavailable: the database cannot be used now.
        """
        with self._counting_errors(writes=True):
            for attempt in range(1, _TRIES):
                try:
                    with self._writer.begin() as session:
                        return work(session, *args, **kwargs)
                except DBAPIError as error:
                    if not database_errors.is_clash(error):
                        raise
                self.retries += 1
                time.sleep(0.01 * 2**attempt)
            with self._writer.begin() as session:
                return work(session, *args, **kwargs)

    def write_at_once(
        self, work: Callable[Concatenate[Session, P], object], /, *args: P.args, **kwargs: P.kwargs
    ) -> None:
        """Run `work(session, *args, **kwargs)` in a separate transaction, unless that would wait for another in SQLite.

        A database that cannot be used now is not an error.
        """
        with suppress(StoreUnavailable), database_errors.named():
            self._guard.admit()
            with self._writer(bind=self._hasty) as session, session.begin():
                work(session, *args, **kwargs)

    def check(self) -> None:
        """Check that the database can be used and has the schema of this version.

        Raises:
            StoreUnavailable: it cannot be used now.
            StoreChanged: it has another schema; the message says what to do.
        """
        with self.reading() as session:
            revisions = session.scalars(text("SELECT version_num FROM alembic_version")).all()
        if list(revisions) != [REVISION]:
            self._guard.change(other_schema(revisions))

    @contextmanager
    def _counting_errors(self, *, writes: bool = False) -> Iterator[None]:
        """Name and count errors of the database, and note whether a transaction that writes had one."""
        try:
            self._guard.admit()
            try:
                with database_errors.named():
                    yield
            except StoreDamaged as error:
                self._guard.damage(error)
        except StoreUnavailable as error:
            self.errors += 1
            self.unwritten = str(error) if writes else self.unwritten
            raise
        self.unwritten = None if writes else self.unwritten

    def dispose(self) -> None:
        """Close the idle connections; the store may be used again."""
        self._engine.dispose()


def new_database(file: Path) -> None:
    """Make a SQLite database in a new file, with the present tables."""
    create(file)
    file.write_bytes(_without_rows())


@cache
def _without_rows() -> bytes:
    """Return a SQLite database with the present tables, which are made once, and are the same bytes in any process."""
    with closing(sqlite3.connect(":memory:")) as connection:
        for table in Base.metadata.sorted_tables:
            indices = sorted(table.indexes, key=lambda index: str(index.name))
            made: list[DDLElement] = [CreateTable(table), *map(CreateIndex, indices)]
            for each in made:
                connection.execute(str(each.compile(dialect=sqlite_dialect.dialect())))
        connection.execute("CREATE TABLE alembic_version (version_num VARCHAR(32) NOT NULL PRIMARY KEY)")
        connection.execute("INSERT INTO alembic_version VALUES (?)", (REVISION,))
        connection.execute("INSERT INTO event_counter (id, latest) VALUES (1, 0)")
        connection.execute("INSERT INTO notifier (id) VALUES (1)")
        connection.commit()
        return connection.serialize()


def transaction(work: Callable[Concatenate[Session, P], T]) -> Callable[Concatenate[Store, P], T]:
    """Turn a function of a session into a use case: called with a store, it runs as `Store.write` does."""

    @wraps(work)
    def use_case(store: Store, /, *args: P.args, **kwargs: P.kwargs) -> T:
        return store.write(work, *args, **kwargs)

    return use_case


def snapshot(work: Callable[Concatenate[Session, P], T]) -> Callable[Concatenate[Store, P], T]:
    """Turn a function that only reads into a use case: called with a store, it reads a snapshot of the database."""

    @wraps(work)
    def use_case(store: Store, /, *args: P.args, **kwargs: P.kwargs) -> T:
        with store.reading() as session:
            return work(session, *args, **kwargs)

    return use_case
