"""Import of archives. An archive is stored as a whole or not at all, and nothing in it is run.

An experiment that had not ended is CANCELLED on arrival, since its archive hides the parameters of reality. One that
had ended arrives unchanged, to the last bit.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import BoundedSemaphore
from typing import IO

from gaplab.schemas.archives import ImportRead
from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import Ending, State
from gaplab.services.archives.checking import Row
from gaplab.services.archives.columns import EXPERIMENT, EXPORTED
from gaplab.services.archives.consistency import check_row, checked_experiments
from gaplab.services.archives.logs import check_logs
from gaplab.services.archives.opening import OpenedArchive, open_archive
from gaplab.services.core.errors import Conflict, InvalidArchive
from gaplab.services.experiments.states import settle
from gaplab.services.specs.hardware import hardware_of
from gaplab.services.specs.resolution import spec_of
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries import archives
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import new_id
from gaplab.services.store.session import Session, Store

AT_ONCE = 4
"""Archives that one process reads at the same time: each takes a core, memory and disk."""

_SLOTS = BoundedSemaphore(AT_ONCE)


@dataclass(frozen=True)
class Arrival:
    """The values that change when rows of an archive are stored.

    Attributes:
        now: time by the database's clock.
        study: id of the study here; None if the archive has none.
        ids: ids of experiments here, by their ids in the archive.
        specs: checked specs of experiments, by their ids in the archive.
    """

    now: datetime
    study: str | None
    ids: Mapping[str, str]
    specs: Mapping[str, Row]


def import_archive(store: Store, file: IO[bytes]) -> ImportRead:
    """Store the content of an archive under its own ids; ids that are taken are replaced.

    Args:
        store: database at the latest revision.
        file: seekable file, at its beginning.

    Raises:
        InvalidArchive: the file is damaged, harmful or not an archive; nothing was stored.
        Conflict: too many archives are being imported at the moment.
    """
    if not _SLOTS.acquire(blocking=False):
        raise Conflict(f"{AT_ONCE} archives are being imported already; try again when they are done")
    try:
        with TemporaryDirectory(prefix="gaplab-import-") as folder:
            opened = open_archive(file, Path(folder))
            experiments = checked_experiments(opened)
            for table in opened.files:
                for row in opened.rows(table):
                    check_row(table, row, experiments)
            return store.write(lambda session: _store(session, opened, experiments))
    finally:
        _SLOTS.release()


def _store(session: Session, opened: OpenedArchive, experiments: Mapping[str, Row]) -> ImportRead:
    studies = {opened.manifest.id} if opened.manifest.kind == "study" else set()
    taken = archives.taken_ids(session, StudyRow, studies)
    renamed = {old: new_id() for old in studies & taken}
    study = next((renamed.get(old, old) for old in studies), None)
    taken = archives.taken_ids(session, ExperimentRow, experiments)
    ids = {old: new_id() if old in taken else old for old in experiments}
    specs = {old: row["spec"] for old, row in experiments.items()}
    arrival = Arrival(archives.database_time(session), study, ids, specs)
    try:
        for table in EXPORTED:
            archives.insert_rows(session, table, (_arriving(table, row, arrival) for row in opened.rows(table)))
    except (*archives.Refused, KeyError) as error:
        msg = "its rows contradict each other: one occurs twice, or belongs to a missing row"
        raise InvalidArchive(msg) from error
    check_logs(session, ids.values())
    for id_ in ids.values():
        note(session, EventKind.IMPORTED, id_)
    settle(session, ids.values())
    return ImportRead(
        study=study,
        experiments=tuple(ids.values()),
        renamed=renamed | {old: new for old, new in ids.items() if old != new},
        called_off=tuple(ids[old] for old, row in experiments.items() if not State(row["state"]).ended),
    )


def _arriving(table: str, row: Row, arrival: Arrival) -> Row:
    """Return the row with the ids of this database."""
    row = dict(row)
    if table == "study":
        return row | {"id": arrival.study}
    if table == "experiment":
        row |= {"spec": arrival.specs[row["id"]], "id": arrival.ids[row["id"]], "study_id": arrival.study}
        row["hardware"] = hardware_of(spec_of(row["spec"]))
    for name in {EXPERIMENT, "experiment_id"} & set(row):
        row[name] = arrival.ids[row[name]]
    if table in {"experiment", "repetition"} and not State(row["state"]).ended:
        row |= {"state": State.CANCELLED, "ended_at": arrival.now}
    if table == "attempt" and row.get("ended_at") is None:
        row |= {"ending": Ending.CANCELLED, "ended_at": arrival.now}
    return row
