"""Rollouts, real-world evaluations and their time, by experiment."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from gaplab.services.store.models import LOG, ExperimentRow, RepetitionRow, StepKind, StepRow
from gaplab.services.store.queries.repetition_rows import MEASURED


def latest(session: Session, count: int) -> tuple[tuple[dict[str, Any], float, int], ...]:
    """Return spec, seconds of work and rollouts of the `count` newest experiments that have started."""
    row, run = ExperimentRow, RepetitionRow
    newest = (
        select(row.id, row.spec)
        .where(row.started_at.is_not(None))
        .order_by(row.created_at.desc(), row.position.desc(), row.id.desc())
        .limit(count)
    )
    specs: dict[str, dict[str, Any]] = dict(session.execute(newest).all())
    sums = (
        select(run.experiment_id, func.sum(run.seconds), func.sum(run.rollouts_done))
        .where(run.experiment_id.in_(list(specs)))
        .group_by(run.experiment_id)
    )
    found = {id_: (float(seconds), int(rollouts)) for id_, seconds, rollouts in session.execute(sums)}
    return tuple((spec, *found[id_]) for id_, spec in specs.items() if id_ in found)


@dataclass(frozen=True)
class Work:
    """The work of an experiment so far.

    Attributes:
        seconds: seconds of computation in its recorded steps.
        samples: real-world evaluations that the strategy learned from.
        probes: real-world evaluations that were only recorded.
    """

    seconds: float = 0.0
    samples: int = 0
    probes: int = 0


def work_of(session: Session, experiments: Sequence[str]) -> dict[str, Work]:
    """Return the work of each experiment."""
    run, row = RepetitionRow, StepRow
    seconds = select(run.experiment_id, func.sum(run.seconds)).where(run.experiment_id.in_(experiments))
    measured = select(run.experiment_id, row.kind, func.count()).join(run, run.id == row.repetition_id)
    real = (row.branch == LOG) & row.kind.in_(MEASURED.values()) & row.measured_by.is_not(None)
    measured = measured.where(run.experiment_id.in_(experiments), real)
    found = session.execute(measured.group_by(run.experiment_id, row.kind))
    counts = {(id_, kind): count for id_, kind, count in found}
    return {
        id_: Work(float(spent or 0.0), counts.get((id_, StepKind.MEASURED), 0), counts.get((id_, StepKind.PROBED), 0))
        for id_, spent in session.execute(seconds.group_by(run.experiment_id))
    }
