"""Attempts: the history of a repetition's leases, written in the transactions that begin and end them.

Beside them are the provenances under which leases begin; each is stored once, under a hash of its facts.
"""

import json
from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from hashlib import sha256
from typing import Any

from sqlalchemy import func, insert, select, update
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import Ending, State
from gaplab.schemas.provenance import Provenance
from gaplab.schemas.records import AttemptRead
from gaplab.services.core.errors import NotFound
from gaplab.services.store.clock import moment, now
from gaplab.services.store.models import AttemptRow, ProvenanceRow, RepetitionRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import of_experiments
from gaplab.services.store.statements import insert_new

_EVENTS = {
    Ending.COMPLETED: EventKind.REPETITION_COMPLETED,
    Ending.WAITING: EventKind.REPETITION_WAITS,
    Ending.PAUSED: EventKind.REPETITION_PAUSED,
    Ending.STOPPED: EventKind.REPETITION_STOPPED,
    Ending.CANCELLED: EventKind.REPETITION_CANCELLED,
    Ending.HANDED_BACK: EventKind.REPETITION_HANDED_BACK,
    Ending.LOST: EventKind.REPETITION_LOST,
    Ending.FAILED: EventKind.REPETITION_FAILED,
}


def begin(session: Session, repetitions: Sequence[int]) -> None:
    """Begin an attempt at each of these claimed repetitions."""
    row = RepetitionRow
    claimed = select(row.id, row.epoch, row.owner, now()).where(row.id.in_(repetitions))
    session.execute(insert(AttemptRow).from_select(["repetition_id", "epoch", "owner", "started_at"], claimed))


def end(session: Session, repetitions: Sequence[int], ending: Ending, reason: str | None = None) -> None:
    """End the open attempts at these repetitions, and record an event for each."""
    row, repetition = AttemptRow, RepetitionRow
    ended = session.scalars(
        update(row)
        .where(row.repetition_id.in_(repetitions), row.ended_at.is_(None))
        .values(ended_at=now(), ending=ending, reason=reason)
        .returning(row.repetition_id)
    ).all()
    rows = select(repetition).where(repetition.id.in_(ended)).order_by(repetition.id)
    for each in session.scalars(rows, execution_options={"populate_existing": True}):
        failed = each.state is State.FAILED
        why = each.error if failed else reason
        kind = EventKind.REPETITION_FAILED if failed else _EVENTS[ending]
        note(session, kind, each.experiment_id, each.number, **({"reason": why} if why else {}))


def latest(session: Session, experiment: str) -> dict[int, int]:
    """Return the number of the latest attempt by repetition, for all repetitions of an experiment with attempts."""
    row = AttemptRow
    found = of_experiments(row, [experiment], row.repetition_id, func.max(row.epoch)).group_by(row.repetition_id)
    return dict(session.execute(found).all())


def work_spans(session: Session, experiments: Sequence[str]) -> dict[str, list[tuple[datetime, datetime]]]:
    """Return begin and end of the work whose results are stored, by experiment.

    Attempts also contain waiting for a core, the step under way, and silence before a loss is noticed. Each span is
    therefore as long as the stored steps took, and ends with its attempt; an attempt that runs ends now.
    """
    if not experiments:
        return {}
    row, repetition, present = AttemptRow, RepetitionRow, moment(session)
    columns = repetition.experiment_id, repetition.id, repetition.seconds, row.started_at, row.ended_at
    query = of_experiments(row, experiments, *columns).where(repetition.seconds > 0)
    found: dict[str, list[tuple[datetime, datetime]]] = {}
    left: dict[int, timedelta] = {}
    for experiment, id_, seconds, started_at, ended_at in session.execute(query.order_by(row.epoch.desc())):
        end = ended_at or present
        took = min(left.setdefault(id_, timedelta(seconds=seconds)), end - started_at)
        left[id_] -= took
        found.setdefault(experiment, []).append((end - took, end))
    return found


def attempts_of(session: Session, experiment: str, number: int, *, secret: bool = True) -> tuple[AttemptRead, ...]:
    """Return the attempts at a repetition, by number; `secret` leaves out what reality's code said about an error.

    Raises:
        NotFound: the experiment has no such repetition.
    """
    repetition = select(RepetitionRow.id).filter_by(experiment_id=experiment, number=number)
    if (id_ := session.scalar(repetition)) is None:
        raise NotFound(f"experiment {experiment!r} has no repetition {number}")
    row = AttemptRow
    return tuple(
        AttemptRead.filled_from(
            each, number=each.epoch, reason=each.reason if secret else each.hidden_reason or each.reason
        )
        for each in session.scalars(select(row).where(row.repetition_id == id_).order_by(row.epoch))
    )


def provenance_id(provenance: Provenance) -> str:
    """Return the id of a provenance: a hash of its facts."""
    return sha256(json.dumps(provenance.model_dump(mode="json"), sort_keys=True).encode()).hexdigest()[:16]


def insert_provenances(session: Session, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add provenances whose ids are new; an equal id means equal facts."""
    session.execute(insert_new(session, ProvenanceRow), [dict(row) for row in rows])
