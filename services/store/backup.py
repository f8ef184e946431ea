"""A consistent copy of a database that is in use."""

import os
import sqlite3
from contextlib import closing, suppress
from pathlib import Path

from services.core.errors import StoreUnavailable, Unsupported
from services.store import troubles
from services.store.engine import open_engine

PG_DUMP = 'pg_dump --format=custom --file={file} "$GAPLAB_DATABASE_URL"'


def backup(url: str, file: Path) -> int:
    """Copy a SQLite database as it is at one moment, though others write to it; the size of the copy in bytes.

    Writers wait while it is copied, which takes as long as the file takes to be read. The copy appears under its name
    once it is whole, checked and on the disk, and only its owner may read it.

    Args:
        url: of the database, at whatever revision it is.
        file: that must not be there yet.

    Raises:
        Unsupported: the database is a Postgres; the message says what copies one.
        StoreUnavailable: there is no database, it is in use for too long, or it is corrupt.
        OSError: the file is there already, or cannot be written.
    """
    engine = open_engine(url)
    if engine.name != "sqlite":
        msg = f"a Postgres database is copied by Postgres' own tool: {PG_DUMP.format(file=file)}"
        raise Unsupported(msg)
    source = engine.url.database
    if source is None or not Path(source).is_file():
        msg = f"there is no database at {source or 'no place'}, so there is nothing to copy"
        raise StoreUnavailable(msg)
    if file.exists():
        raise _taken(file)
    part = file.with_name(f"{file.name}.part")
    os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
    try:
        with troubles.named(), engine.connect() as connection:
            _copy(connection.connection.driver_connection, part)
        _name(part, file)
    finally:
        engine.dispose()
        part.unlink(missing_ok=True)
    _sync(file.parent)
    return file.stat().st_size


def _name(part: Path, file: Path) -> None:
    """Give the copy its name, but not in place of what has got that name meanwhile."""
    try:
        os.link(part, file)
    except FileExistsError as error:
        raise _taken(file) from error
    except OSError:  # no file has two names there
        part.rename(file)


def _taken(file: Path) -> FileExistsError:
    return FileExistsError(None, "a file of this name is there already", str(file))


def _copy(source: sqlite3.Connection | None, part: Path) -> None:
    assert source is not None
    try:
        source.rollback()  # the engine began a transaction, in which nothing was read; the copy has one of its own
        with closing(sqlite3.connect(part)) as target:
            source.backup(target)
            (found,) = target.execute("PRAGMA integrity_check").fetchone()
    except sqlite3.Error as error:
        msg = f"the database cannot be copied: {error}"
        raise StoreUnavailable(msg) from error
    if found != "ok":
        msg = f"the copy is corrupt, and so is the database: {found}"
        raise StoreUnavailable(msg)
    _sync(part)


def _sync(place: Path) -> None:
    """Wait until it is on the disk; not every kind of folder can be waited for."""
    descriptor = os.open(place, os.O_RDONLY)
    with suppress(OSError):
        os.fsync(descriptor)
    os.close(descriptor)
