"""Rollouts, real-world evaluations and their time, by experiment; and totals over the whole database."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import case, func, select
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.services.store.clock import moment
from gaplab.services.store.models import LOG, ExperimentRow, RepetitionRow, StepKind, StepRow, SupervisorRow
from gaplab.services.store.queries.experiments import MEASURED, of_experiments


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
    """Seconds of the recorded steps of an experiment, and its real-world evaluations by kind."""

    seconds: float = 0.0
    samples: int = 0
    probes: int = 0


def work_of(session: Session, experiments: Sequence[str]) -> dict[str, Work]:
    """Return the work of each experiment."""
    run, row = RepetitionRow, StepRow
    seconds = select(run.experiment_id, func.sum(run.seconds)).where(run.experiment_id.in_(experiments))
    real = (row.branch == LOG) & row.kind.in_(MEASURED.values()) & row.measured_by.is_not(None)
    measured = of_experiments(row, experiments, run.experiment_id, row.kind, func.count()).where(real)
    found = session.execute(measured.group_by(run.experiment_id, row.kind))
    counts = {(id_, kind): count for id_, kind, count in found}
    return {
        id_: Work(float(spent or 0.0), counts.get((id_, StepKind.MEASURED), 0), counts.get((id_, StepKind.PROBED), 0))
        for id_, spent in session.execute(seconds.group_by(run.experiment_id))
    }


def ages(session: Session) -> tuple[float, ...]:
    """Return the seconds since each supervisor's last heartbeat, without those that shut down in order.

    A heartbeat from the future was sent before the clock was set back. It counts as old as it is far away.
    """
    present = moment(session)
    beats = session.scalars(select(SupervisorRow.heartbeat_at))
    return tuple(abs((present - beat).total_seconds()) for beat in beats)


@dataclass(frozen=True)
class Totals:
    """Totals over all experiments: numbers by state, rollouts that are needed yet, and what was recorded.

    The ages of supervisors are the seconds since their last heartbeats.
    """

    experiments: dict[State, int]
    repetitions: dict[State, int]
    rollouts_queued: int
    rollouts_done: int
    steps: int
    supervisor_ages_s: tuple[float, ...]


def totals(session: Session) -> Totals:
    """Return the totals: sums over repetitions, by state."""
    row = RepetitionRow
    by_state = select(ExperimentRow.state, func.count()).group_by(ExperimentRow.state)
    left = ExperimentRow.rollouts - row.rollouts_done - row.rollouts_saved
    sums = (func.count(), func.sum(case((left > 0, left), else_=0)), func.sum(row.rollouts_done), func.sum(row.steps))
    found = session.execute(
        select(row.state, *sums).join(ExperimentRow, ExperimentRow.id == row.experiment_id).group_by(row.state)
    ).all()
    return Totals(
        experiments=dict(session.execute(by_state).all()),
        repetitions={state: count for state, count, *_ in found},
        rollouts_queued=sum(int(queued) for state, _, queued, _, _ in found if not state.ended),
        rollouts_done=sum(int(done) for *_, done, _ in found),
        steps=sum(int(steps) for *_, steps in found),
        supervisor_ages_s=ages(session),
    )
