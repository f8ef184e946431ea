"""A consistent copy of a database that is in use."""

import shlex
import sqlite3
from contextlib import closing
from pathlib import Path

from gaplab.services.core.errors import StoreUnavailable, Unsupported
from gaplab.services.store import database_errors
from gaplab.services.store.atomic_files import appearing
from gaplab.services.store.engine import open_engine

PG_DUMP = 'pg_dump --format=custom --file={file} "postgresql:${{GAPLAB_DATABASE_URL#*:}}"'
"""The URL may name a driver before its first colon, as in postgresql+psycopg://; pg_dump accepts none."""


def backup(url: str, file: Path) -> int:
    """Copy a SQLite database as of one moment, even while it is in use, and return the size in bytes.

    Writers wait until the database has been read. The copy appears under its name once it is complete, checked and on
    the disk. Only its owner may read it.

    Args:
        url: URL of the database, at any revision.
        file: file that must not exist yet.

    Raises:
        Unsupported: the database is a Postgres; the message names the tool that copies one.
        StoreUnavailable: there is no database, it is in use for too long, or it is corrupt.
        OSError: the file exists already, or cannot be written.
    """
    engine = open_engine(url)
    if engine.name != "sqlite":
        msg = f"a Postgres database is copied by Postgres' own tool: {PG_DUMP.format(file=shlex.quote(str(file)))}"
        raise Unsupported(msg)
    source = engine.url.database
    if source is None or not Path(source).is_file():
        msg = f"there is no database at {source or 'no place'}, so there is nothing to copy"
        raise StoreUnavailable(msg)
    try:
        with appearing(file, 0o600) as part, database_errors.named(), engine.connect() as connection:
            _copy(connection.connection.driver_connection, part)
    finally:
        engine.dispose()
    return file.stat().st_size


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
