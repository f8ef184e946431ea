"""Import of archives. An archive is stored as a whole or not at all, and nothing in it is run.

It is checked in a private database first, and then copied: SQLite has one writer, so the copy must be quick.

An experiment that had not ended is CANCELLED on arrival, since its archive hides the parameters of reality. Where
reality is a robot on a bench nothing is hidden: it is admitted like a submission, arrives PAUSED, and goes on when a
person resumes it. What it asked the robot for is withdrawn, and computed and forecast again here. An experiment that
had ended arrives unchanged, to the last bit, but without forecasts.
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
from typing import IO

from gaplab.schemas.archives import ImportRead
from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import Ending, State
from gaplab.schemas.measurements import RequestState
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.archives.columns import EXPERIMENT, EXPORTED, Row, columns_of
from gaplab.services.archives.consistency import check_attachments, check_logs, check_row, checked_experiments, owner_of
from gaplab.services.archives.opening import OpenedArchive, ParquetConverter, convert_apart, open_archive
from gaplab.services.core.errors import Conflict, InvalidArchive
from gaplab.services.core.stored_specs import spec_of
from gaplab.services.experiments.limits import FREELY, Admission
from gaplab.services.experiments.states import settle
from gaplab.services.experiments.submission import admit
from gaplab.services.settings import Limits, variable_of
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.specs.rollouts import expected_rollouts, hardware_of
from gaplab.services.store.clock import moment
from gaplab.services.store.queries import archives
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import new_id
from gaplab.services.store.queries.request_states import PENDING
from gaplab.services.store.session import Session, Store, private_store

_REQUEST_IDS = {"id", "request_id", "same_as", "replaces"}
"""Columns with the ids of requests and answers."""

_OF_NO_EXPERIMENT = {"study", "provenance", "robot", "attachment"}
"""Tables whose rows belong to no single experiment."""

AT_ONCE = 4
"""Archives that one process reads at the same time: each takes a core, memory and disk."""

_SLOTS = BoundedSemaphore(AT_ONCE)


@dataclass(frozen=True)
class CheckedArchive:
    """An archive in a private database, where every row has been checked.

    Attributes:
        store: the private database.
        study: id of the study in the archive.
        experiments: the rows of the experiments in the archive, by their ids.
        attachments: files beside measurements, by their hashes; the private database has them without content.
    """

    store: Store
    study: str
    experiments: Mapping[str, Row]
    attachments: Mapping[str, Path]


def import_archive(
    store: Store, file: IO[bytes], admitted: Admission = FREELY, *, convert: ParquetConverter = convert_apart
) -> ImportRead:
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
        with store.reading() as session:
            now = moment(session)
        limits = admitted.limits or Limits()
        with checked_archive(file, now, most_rows=limits.imported_rows, convert=convert) as checked:
            return store.write(_copy, checked, _work_left(checked.experiments, limits), admitted)
    finally:
        _SLOTS.release()


@contextmanager
def checked_archive(
    file: IO[bytes], now: datetime, *, most_rows: int | None = None, convert: ParquetConverter = convert_apart
) -> Iterator[CheckedArchive]:
    """Yield the content of an archive, a seekable file at its beginning, in a private database, which is deleted then.

    Work that the archive shows under way counts as ended `now`. All tables together may have `most_rows`; left out: the
    default of the setting.

    Raises:
        InvalidArchive: the file is damaged, harmful, too large or not an archive.
    """
    with TemporaryDirectory(prefix="gaplab-import-") as folder:
        opened = open_archive(file, Path(folder), most_rows or Limits().imported_rows, convert)
        with private_store(Path(folder) / "checked.db") as private:
            yield private.write(_check, private, opened, now)


def _check(session: Session, private: Store, opened: OpenedArchive, now: datetime) -> CheckedArchive:
    """Store the rows of an archive in the private database, each as it will arrive except for its ids."""
    experiments = checked_experiments(opened)
    for table in EXPORTED:
        _insert(session, table, (_arriving(table, row, experiments, now) for row in opened.rows(table)))
    check_attachments(session, opened)
    check_logs(session, experiments)
    return CheckedArchive(private, opened.manifest.id, experiments, opened.attachments)


def _work_left(experiments: Mapping[str, Row], limits: Limits) -> list[ResolvedSpec]:
    """Return the specs of what goes on here, which could be submitted here; refuse one that is too long."""
    most = 2 * limits.body_bytes  # a resolved spec may be twice as long as what was sent
    for id_, row in experiments.items():
        if (size := len(json.dumps(row["spec"], separators=(",", ":")))) > most:
            permitted = f"{most:,} are permitted, twice {variable_of('body_bytes')}"
            raise InvalidArchive(f"the spec of experiment {id_!r} has {size:,} bytes; {permitted}")
    return [resolve_experiment(spec_of(row["spec"])) for row in experiments.values() if _goes_on(row)]


def _copy(session: Session, checked: CheckedArchive, left: Sequence[ResolvedSpec], admitted: Admission) -> ImportRead:
    """Copy the rows of the private database into the service's, and begin the life of the experiments there."""
    if left:
        admit(session, left, admitted)
    renamed = {old: new_id() for old in archives.taken_ids(session, {checked.study, *checked.experiments})}
    ids = {old: renamed.get(old, old) for old in (checked.study, *checked.experiments)}
    with checked.store.reading() as source:
        for table in EXPORTED:
            owners = [checked.study] if table == "study" else list(checked.experiments)
            sent = {"token_id": admitted.token} if table == "experiment" else {}
            rows = archives.read_rows(source, table, [column.name for column in columns_of(table)], owners)
            _insert(session, table, (_renamed(checked, table, row, ids) | sent for row in rows))
    archives.forget_deletions(session, ids.values())
    arrived = tuple(ids[old] for old in checked.experiments)
    for id_ in arrived:
        note(session, EventKind.IMPORTED, id_)
    settle(session, arrived)
    return ImportRead(
        study=ids[checked.study],
        experiments=arrived,
        renamed=renamed,
        called_off=tuple(
            ids[old] for old, row in checked.experiments.items() if not (State(row["state"]).ended or _goes_on(row))
        ),
    )


def _insert(session: Session, table: str, rows: Iterable[Row]) -> None:
    try:
        archives.insert_rows(session, table, rows)
    except (*archives.Refused, KeyError) as error:
        raise InvalidArchive("its rows contradict each other: one occurs twice, or belongs to a missing row") from error


def _arriving(table: str, row: Row, experiments: Mapping[str, Row], now: datetime) -> Row:
    """Check a row; return it with the checked spec, and without the state of work that another service had begun."""
    check_row(table, row, experiments)
    row = dict(row)
    if table == "experiment":
        row["spec"] = experiments[row["id"]]["spec"]
    if table == "attachment":
        row["content"] = b""
    goes_on = table not in _OF_NO_EXPERIMENT and _goes_on(experiments[owner_of(table, row)])
    if table in {"experiment", "repetition"} and not State(row["state"]).ended:
        resting = {"state": State.PAUSED if table == "experiment" else State.QUEUED}
        row |= resting if goes_on else {"state": State.CANCELLED, "ended_at": now}
    if table == "attempt" and row["ended_at"] is None:
        row |= {"ending": Ending.HANDED_BACK if goes_on else Ending.CANCELLED, "ended_at": now}
    if table == "request":
        row |= {"safety": None}
        row |= {"state": RequestState.WITHDRAWN, "ended_at": now} if row["state"] in PENDING else {}
    return row


def _goes_on(experiment: Row) -> bool:
    return experiment["robot"] is not None and not State(experiment["state"]).ended


def _renamed(checked: CheckedArchive, table: str, row: Row, ids: Mapping[str, str]) -> Row:
    """Return a row under its ids here, that of a file with its content."""
    if table == "attachment":
        return row | {"content": checked.attachments[row["id"]].read_bytes()}
    if table == "study":
        return row | {"id": ids[row["id"]]}
    if table == "experiment":
        row |= {"id": ids[row["id"]], "study_id": ids[row["study_id"]]}
        spec, ended = spec_of(row["spec"]), State(row["state"]).ended
        row |= {"hardware": hardware_of(spec), "paused_because": None if ended else "it was imported"}
        row |= {} if ended else {"rollouts": expected_rollouts(spec)}
    for name in {EXPERIMENT, "experiment_id"} & set(row):
        before, row[name] = row[name], ids[row[name]]
        if table in {"request", "answer"} and before != row[name]:
            row |= {key: _derived(row[name], row[key]) for key in _REQUEST_IDS & set(row)}
    return row


def _derived(experiment: str, id_: str | None) -> str | None:
    """Return the id of a request or an answer in an experiment whose own id was taken."""
    return None if id_ is None else sha256(f"{experiment} {id_}".encode()).hexdigest()[:10]
