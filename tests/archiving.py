"""Archives in tests: exported to bytes, changed by SQL, and imported."""

import sqlite3
from collections.abc import Callable, Mapping
from contextlib import closing
from io import BytesIO
from types import MappingProxyType
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

from gaplab.schemas.archives import ImportRead
from gaplab.services.archives import Archive, import_archive
from gaplab.services.archives.opening import DATABASE
from gaplab.services.experiments.limits import FREELY, Admission
from gaplab.services.settings import Limits
from gaplab.services.store.session import Store


def exported(archive: Archive) -> bytes:
    with archive.file as file:
        return file.read()


def imported(store: Store, archive: bytes | bytearray, most_rows: int | None = None) -> ImportRead:
    admitted = Admission(limits=Limits(imported_rows=most_rows)) if most_rows else FREELY
    return import_archive(store, BytesIO(archive), admitted)


def database_of(archive: bytes) -> bytes:
    """The SQLite database in an archive."""
    with ZipFile(BytesIO(archive)) as opened:
        return opened.read(DATABASE)


def packed(
    database: bytes, others: Mapping[str, bytes] = MappingProxyType({}), compression: int = ZIP_DEFLATED
) -> bytes:
    """An archive of a database, and of other members."""
    file = BytesIO()
    with ZipFile(file, "w", compression) as archive:
        for name, content in {DATABASE: database, **others}.items():
            archive.writestr(name, content)
    return file.getvalue()


def rows(archive: bytes, query: str) -> list[dict[str, Any]]:
    """What a query finds in an archive."""
    with closing(_opened(archive)) as connection:
        connection.row_factory = sqlite3.Row
        return [dict(row) for row in connection.execute(query)]


def dump(archive: bytes) -> str:
    """All that an archive has, as SQL."""
    with closing(_opened(archive)) as connection:
        return "\n".join(connection.iterdump())


def changed(archive: bytes, *changes: str | Callable[[sqlite3.Connection], object]) -> bytes:
    """The archive after changes of its database by statements or functions, which no CHECK and foreign key hinders."""
    with closing(_opened(archive)) as connection:
        connection.execute("PRAGMA ignore_check_constraints=ON")
        for change in changes:
            change(connection) if callable(change) else connection.execute(change)
        connection.commit()
        return packed(connection.serialize())


def loose(archive: bytes) -> bytes:
    """The archive with tables of the same columns, but without keys, constraints and types: any value may be stored."""

    def loosen(connection: sqlite3.Connection) -> None:
        connection.execute("PRAGMA legacy_alter_table=ON")
        tables = "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%'"
        for (name,) in connection.execute(tables).fetchall():
            columns = [each for _, each, *_ in connection.execute(f"PRAGMA table_info([{name}])")]
            connection.execute(f"ALTER TABLE [{name}] RENAME TO old")
            connection.execute(f"CREATE TABLE [{name}] ({', '.join(f'[{each}]' for each in columns)})")
            connection.execute(f"INSERT INTO [{name}] SELECT * FROM old")
            connection.execute("DROP TABLE old")

    return changed(archive, loosen)


def _opened(archive: bytes) -> sqlite3.Connection:
    connection = sqlite3.connect(":memory:")
    connection.deserialize(database_of(archive))
    return connection
