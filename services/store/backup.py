"""A consistent copy of a database that is in use."""

import shlex
import sqlite3
from contextlib import closing
from pathlib import Path

from gaplab.services.core.errors import StoreDamaged, StoreUnavailable, Unsupported
from gaplab.services.store import database_errors
from gaplab.services.store.atomic_files import appearing
from gaplab.services.store.engine import open_engine
from gaplab.services.store.sqlite_file import is_damage

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
        msg = f"there is no database at {source or 'no place'}, so there is nothing to copy"
        raise StoreUnavailable(msg)
    try:
        with appearing(file, 0o600) as part, database_errors.named(), engine.connect() as connection:
            source_connection = connection.connection.driver_connection
            assert source_connection is not None
            source_connection.rollback()  # the engine began a transaction, in which nothing was read
            copy_checked(source_connection, part)
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
            (found,) = target.execute("PRAGMA integrity_check").fetchone()
    except sqlite3.Error as error:
        msg = f"the database cannot be copied: {error}"
        raise (StoreDamaged if is_damage(error) else StoreUnavailable)(msg) from error
    if found != "ok":
        msg = f"the copy is damaged, and so is the database: {found}"
        raise StoreDamaged(msg)
