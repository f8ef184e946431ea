"""A consistent copy of a database that is in use."""

import shlex
import sqlite3
from contextlib import closing
from pathlib import Path

from gaplab.services.store import database_errors
from gaplab.services.store.atomic_files import PRIVATE, appearing
from gaplab.services.store.database_errors import StoreDamaged, StoreUnavailable, Unsupported, is_damage
from gaplab.services.store.engine import open_engine

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
        with appearing(file, PRIVATE) as part, database_errors.named(), engine.connect() as connection:
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
