"""Totals over the whole database, from stored tallies."""

from dataclasses import dataclass

from sqlalchemy import case, func, select
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.services.store.clock import moment
from gaplab.services.store.models import ExperimentRow, RepetitionRow, SupervisorRow


def ages(session: Session) -> tuple[float, ...]:
    """Return the seconds since each supervisor's last heartbeat, without those that shut down in order.

    A heartbeat from the future was sent before the clock was set back. It counts as old as it is far away.
    """
    present = moment(session)
    beats = session.scalars(select(SupervisorRow.heartbeat_at))
    return tuple(abs((present - beat).total_seconds()) for beat in beats)


@dataclass(frozen=True)
class Totals:
    """Totals over all experiments.

    Attributes:
        experiments: their number, by state.
        repetitions: their number, by state.
        rollouts_queued: still needed by repetitions that have not ended.
        rollouts_done: recorded so far.
        steps: recorded so far.
        supervisor_ages_s: seconds since the last heartbeat of each supervisor.
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
