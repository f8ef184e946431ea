"""Export of studies from a store into an archive."""

import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from shutil import copyfileobj
from tempfile import TemporaryDirectory, TemporaryFile
from typing import IO
from zipfile import ZipFile

from gaplab.services.archives.columns import EXPORTED, Row, at_rest, columns_of, resting
from gaplab.services.archives.opening import DATABASE
from gaplab.services.experiments import views
from gaplab.services.results.files import entry_of
from gaplab.services.specs.stored_specs import without_truth
from gaplab.services.specs.submitted import without_parameters
from gaplab.services.store.queries import archives, experiments
from gaplab.services.store.session import Session, Store, new_database
from gaplab.services.store.sqlite_file import url_of


@dataclass(frozen=True)
class Archive:
    """An archive in an open temporary file, at its beginning, which is deleted when it is closed; its size in bytes."""

    name: str
    size: int
    file: IO[bytes]


def export(store: Store, id_: str, *, whole: bool = False) -> Archive:
    """Return an archive of a study at one moment, or of a study with one of its experiments alone.

    The parameters of reality are null until they may be shown, unless it is `whole`. What has not ended is CANCELLED if
    they are null, and else PAUSED. Memory does not grow with the number of results.
    """
    with TemporaryDirectory(prefix="gaplab-export-") as folder:
        file = Path(folder) / DATABASE
        new_database(file)
        with store.reading() as session, Store(url_of(file)) as copy:
            found = experiments.members(session, id_)
            copy.write(_fill, session, found, frozenset() if whole else views.hidden(session, found.experiments))
        with closing(sqlite3.connect(file)) as connection:
            connection.execute("PRAGMA journal_mode=DELETE")  # all is in the one file, also where SQLite has a WAL
        with file.open("rb") as source:
            return _zipped(source, f"gaplab-{found.named.id}.zip")


def _fill(copy: Session, session: Session, found: experiments.Members, hidden: Collection[str]) -> None:
    for table in EXPORTED:
        archives.insert_rows(copy, table, _rows(session, table, found, hidden))


def _rows(session: Session, table: str, found: experiments.Members, hidden: Collection[str]) -> Iterator[Row]:
    """Yield the rows of a table as they are exported: without secrets, leases and other state of running work."""
    open_ = [row for row in found.experiments if not row.state.ended]
    going_on = {row.id for row in open_ if row.id not in hidden or row.spec["reality"]["kind"] == "physical"}
    ids = [found.study.id] if table == "study" else found.ids
    for row in archives.read_rows(session, table, [column.name for column in columns_of(table)], ids):
        if table == "experiment" and row["id"] in hidden:
            row |= {"spec": without_truth(row["spec"])}
        if table == "study" and hidden:
            row |= {"submitted": row["submitted"] and without_parameters(row["submitted"])}
        yield resting(table, row, going_on) | at_rest(table, row)


def _zipped(source: IO[bytes], name: str) -> Archive:
    target = TemporaryFile()  # noqa: SIM115 - the sender closes it
    try:
        with ZipFile(target, "w") as archive, archive.open(entry_of(DATABASE), "w", force_zip64=True) as member:
            copyfileobj(source, member)
        size = target.tell()
        target.seek(0)
    except BaseException:
        target.close()
        raise
    return Archive(name, size, target)
