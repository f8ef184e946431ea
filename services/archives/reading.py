"""An archive back into a store: all of it or nothing, and nothing of it is run.

An experiment that had not ended is called off on its way in: its reality is hidden in the archive, so that nobody could
go on with it. Whatever has ended is as it was, to the last bit.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import BoundedSemaphore
from typing import IO, Any

from pydantic import ValidationError

from gaplab.schemas.archives import ImportRead, Manifest
from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import Ending, State
from gaplab.schemas.provenance import Provenance
from gaplab.schemas.spec import ExperimentSpec, Schedule
from gaplab.services.archives.checking import checked
from gaplab.services.archives.logs import check_logs
from gaplab.services.archives.opening import open_archive
from gaplab.services.core.errors import Conflict, InvalidArchive
from gaplab.services.core.robots import robots
from gaplab.services.core.strategies import strategies
from gaplab.services.core.tunables import tunables
from gaplab.services.experiments.states import settle
from gaplab.services.specs.resolution import is_direct, spec_of
from gaplab.services.store.archive_columns import EXPERIMENT, EXPORTED, REPETITION
from gaplab.services.store.models import SPEC_VERSION, ExperimentRow, StudyRow
from gaplab.services.store.queries import archives, provenance
from gaplab.services.store.queries.events import note
from gaplab.services.store.session import Session, Store

Row = dict[str, Any]

MOST_EXPERIMENTS = 1_000

_RESOLVED = sorted(set(ExperimentSpec.model_fields) - set(Schedule.model_fields))
"""What the spec of an experiment has, once it is resolved."""

AT_ONCE = 4
"""Archives that one process reads at the same time: each takes a core, memory and disk."""

_TURNS = BoundedSemaphore(AT_ONCE)


@dataclass
class Arrival:
    """Where an archive's rows go.

    Attributes:
        now: by the database's clock.
        ids: of studies and experiments, by those in the archive.
        owners: of the archive's experiments, by their ids there.
        called_off: ids of experiments, in the archive, that had not ended.
    """

    now: datetime
    ids: dict[str, str | None]
    owners: dict[str, Row]
    called_off: list[str] = field(default_factory=list)


def import_archive(store: Store, file: IO[bytes]) -> ImportRead:
    """Store what is in an archive, under the ids that it had, or new ones where those are taken.

    Args:
        store: at head.
        file: seekable, at its beginning.

    Raises:
        InvalidArchive: it is none, or was damaged or made to harm; nothing was stored.
        Conflict: too many others are being read.
    """
    if not _TURNS.acquire(blocking=False):
        msg = f"{AT_ONCE} archives are being read already; try again when they are done"
        raise Conflict(msg)
    try:
        with TemporaryDirectory(prefix="gaplab-import-") as folder:
            manifest, tables = open_archive(file, Path(folder))
            owners = _owners(manifest, tables)
            for table in tables:
                for row in _rows(table, tables, manifest):
                    _check_place(table, row, owners)
            return store.write(lambda session: _store(session, manifest, tables, owners))
    finally:
        _TURNS.release()


def _rows(table: str, tables: dict[str, Path], manifest: Manifest) -> Iterator[Row]:
    if table not in tables:
        return iter(())
    member = next(each for name, each in manifest.members.items() if name.partition(".")[0] == table)
    return checked(table, tables[table], member.rows)


def _owners(manifest: Manifest, tables: dict[str, Path]) -> dict[str, Row]:
    """The experiments, by their ids in the archive."""
    owners: dict[str, Row] = {}
    for row in _rows("experiment", tables, manifest):
        if len(owners) == MOST_EXPERIMENTS:
            msg = f"it has more than {MOST_EXPERIMENTS} experiments"
            raise InvalidArchive(msg)
        owners[row["id"]] = row | {"spec": _checked_spec(row)}
    studies = [row["id"] for row in _rows("study", tables, manifest)]
    wanted = [manifest.id] if manifest.kind == "study" else []
    belonging = {row["study_id"] for row in owners.values()}
    if studies != wanted or belonging - {*wanted, *([] if wanted else [None])}:
        msg = f"its study or experiments are not those of the {manifest.kind} {manifest.id!r}"
        raise InvalidArchive(msg)
    if manifest.kind == "experiment" and list(owners) != [manifest.id]:
        msg = f"its experiment is not {manifest.id!r}"
        raise InvalidArchive(msg)
    return owners


def _checked_spec(row: Row) -> Row:
    """The spec, once it is sure that it can be shown."""
    place = f"the spec of experiment {row['id']!r}"
    if row.get("spec_version", SPEC_VERSION) > SPEC_VERSION:
        msg = f"{place} is of version {row['spec_version']}; this gaplab reads up to {SPEC_VERSION}"
        raise InvalidArchive(msg)
    try:
        spec = spec_of(row["spec"])
        truth = dict.fromkeys(row["spec"]["reality"]["parameters"])
    except (ValidationError, KeyError, TypeError, AttributeError) as error:
        msg = f"{place} is no spec"
        raise InvalidArchive(msg) from error
    left_out = [*(name for name in _RESOLVED if row["spec"].get(name) is None), *_left_out(spec)]
    unknown = [name for name in (*truth, *(each.name for each in spec.tunables)) if name not in tunables]
    unknown += [spec.robot.name] if spec.robot.name not in robots else []
    twice = len({each.name for each in spec.tunables}) < len(spec.tunables)
    if left_out or unknown or twice or spec.strategy.name != row["strategy"]:
        msg = f"{place} is not resolved, or names what is not installed here: {', '.join([*left_out, *unknown])[:200]}"
        raise InvalidArchive(msg)
    if row["iterations"] not in _iterations(spec):
        msg = f"{place} does not fit its experiment, which says that a repetition has {row['iterations']:,} iterations"
        raise InvalidArchive(msg)
    return _whole(spec, truth, row["spec"])


def _left_out(spec: ExperimentSpec) -> list[str]:
    """What has nothing to do with what is installed here, and what no resolved spec lacks: nobody may go on without."""
    return [
        *(f"budget/{name}" for name, value in spec.budget if value is None),
        *(
            f"bounds of {each.name}"
            for each in spec.tunables
            if each.lower is None or each.upper is None or each.lower >= each.upper
        ),
        *(["reality/engine"] if spec.reality.engine is None else []),
    ]


def _iterations(spec: ExperimentSpec) -> set[int]:
    """How many a repetition may have; of a strategy that is not installed here, nobody knows whether it iterates."""
    if spec.strategy.name in strategies:
        return {1 if is_direct(spec) else (spec.iterations or 0) + 1}
    return {1, (spec.iterations or 0) + 1}


def _whole(spec: ExperimentSpec, truth: Row, given: Row) -> Row:
    """As it is stored, with what was given and no more; what is not known of its reality is null."""
    stored = {name: value for name, value in spec.model_dump(mode="json").items() if name in given}
    return stored | {"reality": stored["reality"] | {"parameters": truth | stored["reality"]["parameters"]}}


def _check_place(table: str, row: Row, owners: dict[str, Row]) -> None:
    """Refuse a row that belongs to nothing, or that lies outside of what its experiment is."""
    if table == "study":
        return
    if table == "provenance":
        _check_provenance(row)
        return
    owner = owners.get(str(row["id"] if table == "experiment" else row.get(EXPERIMENT) or row.get("experiment_id")))
    number = row.get(REPETITION, row["number"] if table == "repetition" else None)
    iteration = row.get("iteration", row["number"] if table == "iteration" else None)
    if (
        owner is None
        or (number is not None and number >= owner["spec"]["repetitions"])
        or (iteration is not None and iteration >= owner["iterations"])
        or (table == "simulator" and len(row["parameters"]) != len(owner["spec"]["tunables"]))
    ):
        msg = f"a row of {table} does not fit its experiment: {str(row)[:200]}"
        raise InvalidArchive(msg)


def _check_provenance(row: Row) -> None:
    """Refuse facts that are none, or that go by the name of others."""
    try:
        facts = Provenance.model_validate(row["facts"])
    except ValidationError as error:
        msg = f"the facts of provenance {row['id']!r} are none"
        raise InvalidArchive(msg) from error
    if provenance.id_of(facts) != row["id"]:
        msg = f"provenance {row['id']!r} has facts that go by another name"
        raise InvalidArchive(msg)


def _store(session: Session, manifest: Manifest, tables: dict[str, Path], owners: dict[str, Row]) -> ImportRead:
    studies = [manifest.id] if manifest.kind == "study" else []
    ids: dict[str, str | None] = dict(archives.free(session, StudyRow, studies))
    study = ids.get(manifest.id) if studies else None
    renamed = {old: new for old, new in ids.items() if new is not None and old != new}
    found = archives.free(session, ExperimentRow, owners)
    renamed |= {old: new for old, new in found.items() if old != new}
    arrival = Arrival(now=archives.moment(session), ids={**found}, owners=owners)
    try:
        for table in EXPORTED:
            incoming = _rows(table, tables, manifest)
            archives.insert_rows(session, table, (_arriving(table, row, arrival, study) for row in incoming))
    except (*archives.Refused, KeyError) as error:
        msg = "its rows contradict each other: one is there twice, or belongs to what is not there"
        raise InvalidArchive(msg) from error
    check_logs(session, list(found.values()))
    for each in found.values():
        note(session, EventKind.IMPORTED, each)
    settle(session, found.values())
    return ImportRead(
        study=study,
        experiments=tuple(found.values()),
        renamed=renamed,
        called_off=tuple(found[each] for each in arrival.called_off),
    )


def _arriving(table: str, row: Row, arrival: Arrival, study: str | None) -> Row:
    """The row as it is stored here."""
    row = dict(row)
    if table == "study":
        return row | {"id": study}
    if table == "experiment":
        if not State(row["state"]).ended:
            arrival.called_off.append(row["id"])
        row["spec"] = arrival.owners[row["id"]]["spec"]
        row |= {"id": arrival.ids[row["id"]], "study_id": study}
    for name in {EXPERIMENT, "experiment_id"} & set(row):
        row[name] = None if row[name] is None else arrival.ids[row[name]]
    if "study_id" in row:
        row["study_id"] = study
    if table in {"experiment", "repetition"} and not State(row["state"]).ended:
        row |= {"state": State.CANCELLED, "ended_at": arrival.now}
    if table == "attempt" and row.get("ended_at") is None:
        row |= {"ending": Ending.CANCELLED, "ended_at": arrival.now}
    return row
