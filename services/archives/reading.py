"""Import of archives. An archive is stored as a whole or not at all, and nothing in it is run.

It is checked where it was unpacked, and then copied: SQLite has one writer, so the copy must be quick. An experiment
that had not ended is CANCELLED. On a bench it is admitted like a submission, arrives PAUSED, and goes on when a person
resumes it. What it asked the robot for is withdrawn, and computed and forecast again here. An experiment that had ended
arrives unchanged, to the last bit, but without forecasts.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import BoundedSemaphore
from typing import IO, Any

from gaplab.schemas.archives import ImportRead
from gaplab.schemas.events import EventKind
from gaplab.schemas.measurements import RequestState
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.archives.checking import (
    MOST_EXPERIMENTS,
    check_attachments,
    check_logs,
    check_row,
    checked,
    checked_experiments,
    readable,
)
from gaplab.services.archives.columns import EXPERIMENT, EXPORTED, Row, columns_of, is_over, resting
from gaplab.services.archives.opening import open_archive
from gaplab.services.core.errors import Conflict, InvalidArchive
from gaplab.services.experiments.limits import FREELY, Admission
from gaplab.services.experiments.states import settle
from gaplab.services.experiments.submission import admit
from gaplab.services.settings import Limits, variable_of
from gaplab.services.specs.resolution import expected_rollouts, hardware_of, resolve_experiment
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.clock import moment
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries import archives
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import new_id
from gaplab.services.store.queries.requests import PENDING
from gaplab.services.store.session import Session, Store
from gaplab.services.store.sqlite_file import url_of

_REQUEST_IDS = {"id", "request_id", "same_as", "replaces"}
"""Columns with the ids of requests and answers."""

AT_ONCE = 4
"""Archives that one process reads at the same time: each takes a core, memory and disk."""

_SLOTS = BoundedSemaphore(AT_ONCE)


@dataclass(frozen=True)
class CheckedArchive:
    """An archive in which every row has been checked.

    Attributes:
        store: a database of our own with its rows.
        at_once: number of rows that fit in memory.
        study: id of the study in it.
        experiments: the rows of the experiments in it, by their ids, with checked specs.
    """

    store: Store
    at_once: int
    study: str
    experiments: Mapping[str, Row]

    @property
    def going_on(self) -> frozenset[str]:
        """The experiments that had not ended, and of whose reality nothing is hidden: they can go on here."""
        return frozenset(
            id_
            for id_, row in self.experiments.items()
            if not is_over(row) and None not in row["spec"]["reality"]["parameters"].values()
        )

    @property
    def called_off(self) -> list[str]:
        """The other experiments that had not ended."""
        return [id_ for id_, row in self.experiments.items() if id_ not in self.going_on and not is_over(row)]

    def rows(self, session: Session, table: str) -> Iterator[Row]:
        """Yield the rows of a table; the session is of `store`."""
        owners = [self.study] if table == "study" else list(self.experiments)
        return _rows(session, table, owners, self.at_once)


def import_archive(store: Store, file: IO[bytes], admitted: Admission = FREELY) -> ImportRead:
    """Store the content of an archive, a seekable file at its beginning, under its own ids; taken ones are replaced.

    The limits are those of `admitted`; left out: those of rows and of the size of a spec, by default.

    Raises:
        InvalidArchive: the file is damaged, harmful, too large or not an archive; nothing was stored.
        InvalidSpec: what had not ended could not be submitted here.
        CostUnconfirmed: its cost is above the limit, and the request does not confirm it.
        LimitReached: too much work is in progress.
        Conflict: too many archives are being imported at the moment.
    """
    if not _SLOTS.acquire(blocking=False):
        raise Conflict(f"{AT_ONCE} archives are being imported already; try again when they are done")
    try:
        limits = admitted.limits or Limits()
        with checked_archive(file, most_rows=limits.imported_rows) as found:
            return store.write(_copy, found, _work_left(found, limits), admitted)
    finally:
        _SLOTS.release()


@contextmanager
def checked_archive(file: IO[bytes], *, most_rows: int | None = None) -> Iterator[CheckedArchive]:
    """Yield the content of an archive, a seekable file at its beginning, in a temporary database.

    All tables together may have `most_rows`; left out: the default of the setting.

    Raises:
        InvalidArchive: the file is damaged, harmful, too large or not an archive.
    """
    with _opened(file, most_rows) as (private, at_once):
        with private.reading() as session, readable("it"):
            found = _check(session, private, at_once)
        yield found


def archived_specs(file: IO[bytes]) -> tuple[Any, ...]:
    """Return the specs in an archive, unchecked, whose plug-ins may be missing here.

    Raises:
        InvalidArchive: the file is damaged, harmful, too large or not an archive.
    """
    with _opened(file, None) as (private, at_once), private.reading() as session, readable("it"):
        ids = archives.all_ids(session, ExperimentRow)
        return tuple(row["spec"] for row in archives.read_rows(session, "experiment", ["spec"], ids, at_once))


@contextmanager
def _opened(file: IO[bytes], most_rows: int | None) -> Iterator[tuple[Store, int]]:
    with TemporaryDirectory(prefix="gaplab-import-") as folder:
        database, at_once = open_archive(file, Path(folder), most_rows or Limits().imported_rows)
        with Store(url_of(database)) as private:
            yield private, at_once


def _rows(session: Session, table: str, owners: Sequence[str], at_once: int, *without: type) -> Iterator[Row]:
    """Yield rows, without columns of these types."""
    columns = [column.name for column in columns_of(table) if column.type not in without]
    return archives.read_rows(session, table, columns, owners, at_once)


def _check(session: Session, private: Store, at_once: int) -> CheckedArchive:
    studies, ids = archives.all_ids(session, StudyRow), archives.all_ids(session, ExperimentRow)
    if len(studies) != 1 or not 0 < len(ids) <= MOST_EXPERIMENTS:
        few = f"not one study with 1 to {MOST_EXPERIMENTS:,} experiments"
        raise InvalidArchive(f"it has {len(studies):,} studies and {len(ids):,} experiments, and {few}")

    def rows(table: str) -> Iterator[Row]:
        owners = studies if table == "study" else ids
        return checked(table, _rows(session, table, owners, at_once, bytes))

    (study,) = studies
    experiments = checked_experiments(rows, study)
    for table in sorted(EXPORTED, key="attachment".__eq__):  # answers name the attachments, and are checked before
        for row in rows(table):
            check_row(table, row, experiments)
    check_attachments(session)
    check_logs(session, study, at_once)
    return CheckedArchive(private, at_once, study, experiments)


def _work_left(found: CheckedArchive, limits: Limits) -> list[ResolvedSpec]:
    """Return the specs of what goes on here, which could be submitted here; refuse one that is too long."""
    most = 2 * limits.body_bytes  # a resolved spec may be twice as long as what was sent
    for id_, row in found.experiments.items():
        if (size := len(json.dumps(row["spec"], separators=(",", ":")))) > most:
            permitted = f"{most:,} are permitted, twice {variable_of('body_bytes')}"
            raise InvalidArchive(f"the spec of experiment {id_!r} has {size:,} bytes; {permitted}")
    going_on = [row for id_, row in found.experiments.items() if id_ in found.going_on]
    return [resolve_experiment(spec_of(row["spec"])) for row in going_on]


def _copy(session: Session, found: CheckedArchive, left: Sequence[ResolvedSpec], admitted: Admission) -> ImportRead:
    """Copy the rows of the archive into the service's database, and begin the life of the experiments there."""
    if left:
        admit(session, left, admitted)
    now = moment(session)
    renamed = {old: new_id() for old in archives.taken_ids(session, {found.study, *found.experiments})}
    ids = {old: renamed.get(old, old) for old in (found.study, *found.experiments)}
    sent = {"experiment": {"token_id": admitted.token}}
    with found.store.reading() as source:
        for table in EXPORTED:
            arriving = (_renamed(table, _arriving(found, table, row, now), ids) for row in found.rows(source, table))
            _insert(session, table, (row | sent.get(table, {}) for row in arriving), found.at_once)
    archives.forget_deletions(session, ids.values())
    experiments = tuple(ids[old] for old in found.experiments)
    for id_ in experiments:
        note(session, EventKind.IMPORTED, id_)
    settle(session, experiments)
    called_off = tuple(ids[old] for old in found.called_off)
    return ImportRead(study=ids[found.study], experiments=experiments, renamed=renamed, called_off=called_off)


def _insert(session: Session, table: str, rows: Iterable[Row], at_once: int) -> None:
    try:
        archives.insert_rows(session, table, rows, at_once)
    except (*archives.Refused, KeyError) as error:
        raise InvalidArchive("its rows contradict each other: one occurs twice, or belongs to a missing row") from error


def _arriving(found: CheckedArchive, table: str, row: Row, now: datetime) -> Row:
    """Return a row with what this service says about it: the checked spec, no forecasts, nothing that is under way."""
    if table == "request":
        withdrawn = {"state": RequestState.WITHDRAWN, "ended_at": now} if row["state"] in PENDING else {}
        return row | {"safety": None} | withdrawn
    if table == "experiment":
        spec = found.experiments[row["id"]]["spec"]
        known, over = spec_of(spec), is_over(row)
        row |= {"spec": spec, "hardware": hardware_of(known), "paused_because": None if over else "it was imported"}
        row |= {} if over else {"rollouts": expected_rollouts(known)}
    return resting(table, row, found.going_on, now)


def _renamed(table: str, row: Row, ids: Mapping[str, str]) -> Row:
    """Return a row under its ids here."""
    if table in {"study", "experiment"}:
        return row | {"id": ids[row["id"]]} | ({"study_id": ids[row["study_id"]]} if table == "experiment" else {})
    for name in {EXPERIMENT, "experiment_id"} & set(row):
        before, row[name] = row[name], ids[row[name]]
        if table in {"request", "answer"} and before != row[name]:
            given = {key: row[key] for key in _REQUEST_IDS & set(row) if row[key] is not None}
            row |= {key: sha256(f"{row[name]} {id_}".encode()).hexdigest()[:10] for key, id_ in given.items()}
    return row
