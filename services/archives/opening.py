"""Opening of archives: a zip with one SQLite database, whose rows are copied into a new database with our own tables.

Sizes are those of unpacked members. The archive's schema is read, compared and then not used: no trigger, view, virtual
table, index, CHECK, DEFAULT or computed column of it is ever evaluated. Keys and constraints are those of our tables.
Source: https://sqlite.org/security.html.
"""

import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from errno import EINVAL
from hashlib import sha256
from pathlib import Path
from threading import Lock
from time import monotonic
from typing import IO, Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile
from zlib import error as ZlibError  # noqa: N812 - it is an error

from gaplab.services.archives.columns import LEFT_OUT
from gaplab.services.core.errors import InvalidArchive
from gaplab.services.settings import variable_of
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.models.base import REVISION
from gaplab.services.store.queries import attachments
from gaplab.services.store.session import new_database
from gaplab.services.store.sqlite_file import url_of

DATABASE = "study.sqlite3"
"""The only member of an archive."""

MOST_BYTES = 512 * 2**20
"""Size of the database without files; a study of the paper's size has about ten million bytes."""

MOST_BYTES_OF_FILES = 2**30
"""Size of all files beside measurements."""

MOST_FILES = 10_000
"""Files beside measurements."""

LONGEST_ROW = 8 * 2**20
"""Most characters of one row."""

MOST_BYTES_OF_DIRECTORY = 4 * 2**20

MOST_SECONDS = 300.0
"""Time that SQLite may take to read a database."""

_LONGEST_STATEMENT = 100_000
_STEPS_TO_READ_A_SCHEMA = 10_000
"""Instructions of SQLite's machine; our schema takes some 2,000. One with a million tables would fill memory."""

_STEPS_AT_ONCE = 100_000
_CHUNK = 2**16
_ROWS_IN_MEMORY, _CHARACTERS_IN_MEMORY = 500, 2**24

_PLAIN = ("CREATE TABLE ", "CREATE INDEX ", "CREATE UNIQUE INDEX ")
"""How SQLite stores the statements of tables and indices, and of nothing else."""

_NOT_COPIED = {"alembic_version", *LEFT_OUT}

_MIGRATING = Lock()
"""Alembic's environment is one for the process."""


def open_archive(file: IO[bytes], folder: Path, most_rows: int) -> tuple[Path, int]:
    """Return an archive as a database with our own tables, in a folder, and the number of rows that fit in memory.

    The database is at the present revision, with unchecked values; its tables have at most `most_rows` together.

    Raises:
        InvalidArchive: the file is damaged, harmful, not an archive, or written by a later version.
    """
    given, database = folder / DATABASE, folder / "copied.sqlite3"
    with readable_zip(file) as archive:
        _unpack(archive, given)
    try:
        with closing(sqlite3.connect(f"{given.as_uri()}?mode=ro&immutable=1", uri=True)) as source:
            revision = _revision(source)
            if revision == REVISION:
                new_database(database)
            else:
                _migrate(database, revision, f"its database is at revision {revision[:100]}, which is unknown")
            with closing(sqlite3.connect(database)) as target:
                longest = _copy(source, target, most_rows)
    except sqlite3.IntegrityError as error:
        raise InvalidArchive(f"its rows contradict each other: {error}"[:300]) from error
    except (sqlite3.Error, UnicodeDecodeError) as error:  # the latter of a name in a damaged schema
        raise InvalidArchive(f"its database cannot be read: {error}"[:300]) from error
    given.unlink()
    if revision != REVISION:
        _migrate(database, "head", f"its database of revision {revision} cannot be read")
    return database, max(1, min(_ROWS_IN_MEMORY, _CHARACTERS_IN_MEMORY // max(1, longest)))


class _Bounded:
    """A file whose parts are read with a limit: `zipfile` reads the directory of a zip at once, and keeps it."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self.seek, self.tell, self.seekable = file.seek, file.tell, file.seekable

    def read(self, size: int = -1) -> bytes:
        """Return the next bytes.

        Raises:
            InvalidArchive: too many are asked for.
        """
        if size > MOST_BYTES_OF_DIRECTORY:
            raise InvalidArchive(f"its directory has {size:,} bytes; {MOST_BYTES_OF_DIRECTORY:,} are permitted")
        return self._file.read(size)


@contextmanager
def readable_zip(file: IO[bytes]) -> Iterator[ZipFile]:
    """Yield a zip that is open for reading.

    Raises:
        InvalidArchive: it, or what is read of it meanwhile, is damaged, encrypted or not a zip.
        OSError: the file cannot be read.
    """
    try:
        with ZipFile(_Bounded(file)) as archive:
            yield archive
    except (BadZipFile, ZlibError, EOFError, NotImplementedError, RuntimeError, ValueError, OverflowError) as error:
        raise InvalidArchive(f"it is not a readable zip: {type(error).__name__}") from error
    except OSError as error:
        if error.errno != EINVAL:  # a place before the file's beginning
            raise
        raise InvalidArchive("it is not a readable zip: its directory points outside of it") from error


def _unpack(archive: ZipFile, target: Path) -> None:
    names = [info.filename for info in archive.infolist()]
    if names != [DATABASE]:
        found = ", ".join(name[:64] for name in names[:5]) or "nothing"
        raise InvalidArchive(f"it is not an archive of gaplab, which has {DATABASE} alone; it has {found}")
    (info,) = archive.infolist()
    if info.compress_type not in {ZIP_STORED, ZIP_DEFLATED} or info.flag_bits & 1:
        raise InvalidArchive(f"{DATABASE} is encrypted, or compressed by another method than deflate")
    size, most = 0, MOST_BYTES + MOST_BYTES_OF_FILES
    with archive.open(info) as opened, target.open("xb") as file:
        while (chunk := opened.read(_CHUNK)) and (size := size + len(chunk)) <= most:
            file.write(chunk)
    if size > most:
        raise InvalidArchive(f"unpacked it has more than {most:,} bytes: export its experiments one by one")


def _revision(connection: sqlite3.Connection) -> str:
    """Return the revision of the archive's database, which may have nothing but tables and indices."""
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, attachments.MOST_BYTES + LONGEST_ROW)
    connection.setlimit(sqlite3.SQLITE_LIMIT_SQL_LENGTH, _LONGEST_STATEMENT)
    connection.execute("PRAGMA trusted_schema=OFF")
    connection.execute("PRAGMA cell_size_check=ON")
    connection.set_progress_handler(lambda: 1, _STEPS_TO_READ_A_SCHEMA)
    for name, sql in connection.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL"):
        if not str(sql).startswith(_PLAIN):
            raise InvalidArchive(f"its database has more than tables and indices: {str(name)[:64]!r}")
    until = monotonic() + MOST_SECONDS
    connection.set_progress_handler(lambda: monotonic() > until, _STEPS_AT_ONCE)
    if _columns(connection, "alembic_version") != ["version_num"]:
        raise InvalidArchive("its database is not one of gaplab: it does not say its revision")
    found = [str(each) for (each,) in connection.execute("SELECT version_num FROM alembic_version LIMIT 2")]
    if len(found) != 1 or not found[0].isascii() or not found[0].isdigit() or found[0] > REVISION:
        told = ", ".join(found)[:100] or "none"
        raise InvalidArchive(f"its database is at revision {told}; this version of gaplab reads up to {REVISION}")
    return found[0]


def _migrate(database: Path, revision: str, problem: str) -> None:
    try:
        with _MIGRATING:
            from gaplab.migrations import upgrade  # Alembic takes half a second, and few archives are earlier ones

            upgrade(url_of(database), to=revision)
    except StoreUnavailable as error:
        raise InvalidArchive(f"{problem}: {error}"[:300]) from error


def _columns(connection: sqlite3.Connection, table: str) -> list[str]:
    """Return the names of the columns of a table; that of a computed one says so."""
    found = connection.execute(f"PRAGMA table_xinfo([{table}])")
    return [f"{name} (computed)" if hidden else str(name) for _, name, _, _, _, _, hidden in found]


def _copy(source: sqlite3.Connection, target: sqlite3.Connection, most_rows: int) -> int:
    """Copy the tables that archives have, and return the characters of the longest row."""
    target.execute("PRAGMA journal_mode=OFF")
    target.execute("PRAGMA synchronous=OFF")
    names = [name for (name,) in target.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
    tables = {
        name: _columns(target, name) for name in names if name not in _NOT_COPIED and not name.startswith("sqlite_")
    }
    _check_tables(source, tables)
    size = _Size(most_rows)
    for table, columns in tables.items():
        listed = ", ".join(f"[{each}]" for each in columns)
        rows = source.execute(f"SELECT {listed} FROM [{table}] NOT INDEXED")  # noqa: S608 - our names
        into = f"INSERT INTO [{table}] ({listed}) VALUES ({', '.join('?' * len(columns))})"  # noqa: S608
        target.executemany(into, size.counted(table, columns, rows))
    if orphan := target.execute("PRAGMA foreign_key_check").fetchone():
        raise InvalidArchive(f"its rows contradict each other: one of {orphan[0]} belongs to a missing row")
    target.commit()
    return size.longest


def _check_tables(source: sqlite3.Connection, tables: Mapping[str, Sequence[str]]) -> None:
    """Refuse a database whose tables lack columns, or have others."""
    for table, columns in tables.items():
        found = _columns(source, table)
        if not found:
            raise InvalidArchive(f"its database has no table {table}")
        if wrong := set(columns) ^ set(found):
            raise InvalidArchive(f"its table {table} lacks columns, or has others: {', '.join(sorted(wrong))[:200]}")


class _Size:
    """The size of an archive, counted while its rows are copied, and compared with what is permitted."""

    def __init__(self, most_rows: int) -> None:
        self._most_rows = most_rows
        self._rows = self._bytes = self._files = self._bytes_of_files = self.longest = 0

    def counted(self, table: str, columns: Sequence[str], rows: Iterator[Any]) -> Iterator[Any]:
        """Yield the rows of a table.

        Raises:
            InvalidArchive: there are too many, they are too long, or one has bytes and is not a file.
        """
        content = columns.index("content") if table == "attachment" else None
        for number, row in enumerate(rows, 1):
            self._rows += 1
            if self._rows > self._most_rows:
                self._refuse(f"it has more than {self._most_rows:,} rows ({variable_of('imported_rows')})")
            if any(isinstance(each, bytes) and place != content for place, each in enumerate(row)):
                raise InvalidArchive(f"{table}, row {number} has bytes where its column has another type")
            if (length := sum(len(each) for each in row if isinstance(each, str))) > LONGEST_ROW:
                raise InvalidArchive(f"{table}, row {number} has more than {LONGEST_ROW:,} characters")
            self.longest, self._bytes = max(self.longest, length), self._bytes + length
            if self._bytes > MOST_BYTES:
                self._refuse(f"its rows have more than {MOST_BYTES:,} characters")
            if content is not None:
                self._count_file(row[columns.index("id")], row[content])
            yield row

    def _count_file(self, id_: Any, content: Any) -> None:  # noqa: ANN401 - values from an archive
        if not isinstance(content, bytes) or not 0 < len(content) <= attachments.MOST_BYTES:
            raise InvalidArchive(f"the attachment {str(id_)[:64]!r} must have 1 to {attachments.MOST_BYTES:,} bytes")
        if sha256(content).hexdigest() != id_:
            raise InvalidArchive(f"the content of the attachment {id_[:64]!r} has another hash: it was changed")
        self._files, self._bytes_of_files = self._files + 1, self._bytes_of_files + len(content)
        if self._files > MOST_FILES:
            self._refuse(f"it has more than {MOST_FILES:,} attachments")
        if self._bytes_of_files > MOST_BYTES_OF_FILES:
            self._refuse(f"its attachments have more than {MOST_BYTES_OF_FILES:,} bytes")

    @staticmethod
    def _refuse(what: str) -> None:
        raise InvalidArchive(f"{what}: export its experiments one by one")
