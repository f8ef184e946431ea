"""Backups: a consistent copy of a database that is in use, and a copy put in its place."""

import os
import shlex
import sqlite3
from contextlib import closing, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from sqlalchemy import URL

from gaplab.services.store import database_errors
from gaplab.services.store.atomic_files import PRIVATE, appearing, replacing
from gaplab.services.store.database_errors import StoreDamaged, StoreUnavailable, Unsupported, is_damage
from gaplab.services.store.engine import open_engine, parse
from gaplab.services.store.models import REVISION
from gaplab.services.store.models.base import is_later
from gaplab.services.store.sqlite_file import COMPANIONS, file_of, unused

PG_DUMP = 'pg_dump --format=custom --file={file} "postgresql:${{GAPLAB_DATABASE_URL#*:}}"'
"""The URL may name a driver before its first colon, as in postgresql+psycopg://; pg_dump accepts none."""


def backup(url: str, file: Path) -> int:
    """Copy a SQLite database as of one moment, even while it is in use, and return the size in bytes.

    Writers wait until the database has been read. The copy lacks the space that deleted rows leave in the database. It
    appears under its name once it is complete, checked and on the disk. Only its owner may read it.

    Args:
        url: URL of the database, at any revision.
        file: file that must not exist yet.

    Raises:
        Unsupported: the database is a Postgres; the message names the tool that copies one.
        StoreUnavailable: there is no database, or it is in use for too long.
        StoreDamaged: the database is damaged.
        OSError: the file exists already, or cannot be written.
    """
    engine = open_engine(url)
    if engine.name != "sqlite":
        msg = f"a Postgres database is copied by Postgres' own tool: {PG_DUMP.format(file=shlex.quote(str(file)))}"
        raise Unsupported(msg)
    source = engine.url.database
    if source is None or not Path(source).is_file():
        raise StoreUnavailable(f"there is no database at {source or 'this URL'}, so there is nothing to copy")
    try:
        with appearing(file) as part, database_errors.named(), engine.connect() as connection:
            source_connection = connection.connection.driver_connection
            assert source_connection is not None
            source_connection.rollback()  # the engine began a transaction, in which nothing was read
            copy_checked(source_connection, part)
            _compact(part)
    finally:
        engine.dispose()
    return file.stat().st_size


def copy_checked(source: sqlite3.Connection, part: Path) -> None:
    """Copy a database as of one moment into a file, and check the copy.

    Raises:
        StoreUnavailable: it cannot be read, or is in use for too long.
        StoreDamaged: it is damaged.
    """
    try:
        with closing(sqlite3.connect(part)) as target:
            source.backup(target)
            _refuse_damaged(target, "the copy is damaged, and so is the database")
    except sqlite3.Error as error:
        raise _not_copied(error) from error


def _compact(part: Path) -> None:
    """Replace a copy by a smaller one without free pages, checked too; it is written beside it.

    Raises:
        StoreUnavailable: it cannot be written.
        StoreDamaged: it is damaged.
    """
    smaller = part.with_name(f"{part.stem}.compact.part")
    try:
        with closing(sqlite3.connect(part)) as copy:
            (free,) = copy.execute("PRAGMA freelist_count").fetchone()
            if not free:
                return
            smaller.touch(PRIVATE, exist_ok=False)
            copy.execute("VACUUM INTO ?", (str(smaller),))
        with closing(sqlite3.connect(smaller)) as compacted:
            _refuse_damaged(compacted, "the compacted copy is damaged")
        smaller.replace(part)
    except sqlite3.Error as error:
        raise _not_copied(error) from error
    finally:
        smaller.unlink(missing_ok=True)


def _refuse_damaged(copy: sqlite3.Connection, what: str) -> None:
    (found,) = copy.execute("PRAGMA integrity_check").fetchone()
    if found != "ok":
        raise StoreDamaged(f"{what}: {found}")


def _not_copied(error: sqlite3.Error) -> StoreUnavailable:
    return (StoreDamaged if is_damage(error) else StoreUnavailable)(f"the database cannot be copied: {error}")


PG_RESTORE = (
    "dropdb {server}{database} && createdb {server}--owner={owner} {database} && "
    "pg_restore --single-transaction --exit-on-error --no-owner "
    '--dbname="postgresql:${{GAPLAB_DATABASE_URL#*:}}" {file}'
)
"""A new, empty database, and all of the dump in it or nothing: `--clean` keeps tables that the dump does not have."""


@dataclass(frozen=True)
class Restored:
    """A restored database; what was there before, under another name; and the revision of the schema.

    An older one than this version's is migrated by the next `gaplab serve`.
    """

    file: Path
    kept: Path | None
    revision: str


def restore(url: str, source: Path) -> Restored:
    """Put a backup, which stays as it is, in the place of the database, which keeps its content under another name.

    The backup is copied, and checked, before anything is replaced. A crash leaves either the former database or the
    restored one under the name.

    Raises:
        Unsupported: the database is a Postgres; the message says what restores one.
        StoreUnavailable: a service runs on the database, or the file is not a backup that this version can use.
        StoreDamaged: the backup is damaged.
        OSError: the file is absent, or the database's folder cannot be written.
    """
    file = _place(url, source)
    with unused(file), replacing(file) as part:
        _copy_backup(source, part)
        revision = _check_copy(source, part)
        kept = _set_aside(file) if file.exists() else None
    return Restored(file, kept, revision)


def _place(url: str, source: Path) -> Path:
    parsed = parse(url)
    if parsed.get_backend_name() != "sqlite":
        msg = (
            "a Postgres database is restored by Postgres' own tools, once every service on it has ended; "
            f"dropdb and createdb are for the server's administrator: {_postgres_line(parsed, source)}"
        )
        raise Unsupported(msg)
    if (file := file_of(parsed)) is None:
        raise StoreUnavailable(f"{url} names no file, so nothing can be restored to it")
    if not source.is_file():
        raise FileNotFoundError(None, "there is no such file", str(source))
    if file.exists() and file.samefile(source):
        raise StoreUnavailable(f"{source} is the database itself, not a backup of it")
    return file


def _postgres_line(url: URL, source: Path) -> str:
    given = {"host": url.host or url.query.get("host"), "port": url.port or url.query.get("port")}
    server = "".join(f"--{name}={shlex.quote(str(value))} " for name, value in given.items() if value)
    owner = url.username or "gaplab"
    return PG_RESTORE.format(
        server=server,
        owner=shlex.quote(owner),
        database=shlex.quote(url.database or owner),
        file=shlex.quote(str(source)),
    )


def _copy_backup(source: Path, part: Path) -> None:
    """Copy what the backup holds, including transactions that are still in its journal."""
    try:
        with closing(sqlite3.connect(f"{source.absolute().as_uri()}?mode=ro", uri=True)) as connection:
            copy_checked(connection, part)
    except StoreDamaged as error:
        raise StoreDamaged(f"{source} is damaged, or is not a database: {error}") from error
    except sqlite3.Error as error:
        raise StoreUnavailable(f"{source} cannot be read: {error}") from error


def _check_copy(source: Path, copy: Path) -> str:
    """Return the revision of the copy's schema, if it is a whole database of gaplab."""
    with closing(sqlite3.connect(copy)) as connection:
        try:
            (revision,) = connection.execute("SELECT version_num FROM alembic_version").fetchone() or (None,)
            connection.execute("SELECT 1 FROM experiment, repetition LIMIT 1")
        except sqlite3.OperationalError as error:
            raise StoreUnavailable(f"{source} is not a database of gaplab: {error}") from error
        if revision is None:
            raise StoreUnavailable(f"{source} is not a database of gaplab: its schema has no revision")
        if is_later([revision]):
            msg = f"{source} is of a later version of gaplab: its revision is {revision}, this version knows {REVISION}"
            raise StoreUnavailable(msg)
        if broken := connection.execute("PRAGMA foreign_key_check").fetchone():
            msg = f"{source} is damaged: a row of {broken[0]} refers to a row of {broken[2]} that is missing"
            raise StoreDamaged(msg)
    return str(revision)


def _set_aside(file: Path) -> Path:
    """Give the database a second name, and take its journals away from the first; return the second name."""
    with suppress(sqlite3.Error), closing(sqlite3.connect(file)) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")  # opening it has brought its journals in
    kept = file.with_name(f"{file.name}.replaced-{datetime.now(UTC):%Y%m%dT%H%M%S.%fZ}")
    os.link(file, kept)
    for ending in COMPANIONS:
        with suppress(FileNotFoundError):
            file.with_name(file.name + ending).rename(kept.with_name(kept.name + ending))
    return kept
