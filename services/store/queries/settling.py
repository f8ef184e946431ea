"""What follows for an experiment from the states of its repetitions; whoever has moved one of them settles it."""

from collections.abc import Iterable
from typing import Any

from sqlalchemy import case, func, select, update
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import State
from gaplab.services.store.clock import now
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries.events import note

_MAY_START = (State.QUEUED, State.RUNNING)

_TOLD = {
    State.RUNNING: EventKind.STARTED,
    State.PAUSED: EventKind.PAUSED,
    State.COMPLETED: EventKind.COMPLETED,
    State.FAILED: EventKind.FAILED,
    State.CANCELLED: EventKind.CANCELLED,
}
"""What an experiment moves to of itself; the other moves are asked for."""


def settle(session: Session, experiments: Iterable[str]) -> None:
    """Bring these experiments, which are locked, in line with their repetitions.

    One without a repetition that is left to run ends; one whose last step before a pause is over is PAUSED; of one that
    is being stopped, no queued repetition is left. The counts that decide about turns are kept here, and only here.
    """
    for experiment in experiments:
        _settle(session, experiment)


def _settle(session: Session, experiment: str) -> None:
    row = ExperimentRow
    state, limit = session.execute(select(row.state, row.max_parallel).where(row.id == experiment)).one()
    if state is State.STOPPING:
        _keep_what_is_there(session, experiment)
    counts = _counts(session, experiment)
    queued, running = counts.get(State.QUEUED, 0), counts.get(State.RUNNING, 0)
    following = _following(state, queued, running, set(counts))
    values: dict[str, Any] = {
        "running": running,
        "claimable": following in _MAY_START and queued > 0 and (limit is None or running < limit),
    }
    if following is not state:
        values |= {"state": following} | ({"ended_at": now()} if following.ended else {})
        note(session, _TOLD[following], experiment)
    session.execute(update(row).where(row.id == experiment).values(values))


def _following(state: State, queued: int, running: int, states: set[State]) -> State:
    if state.ended:
        return state
    if not queued + running:
        return next((end for end in (State.COMPLETED, State.FAILED) if end in states), State.CANCELLED)
    if state is State.PAUSING and not running:
        return State.PAUSED
    return State.RUNNING if state is State.QUEUED and running else state


def _counts(session: Session, experiment: str) -> dict[State, int]:
    row = RepetitionRow
    counted = select(row.state, func.count()).where(row.experiment_id == experiment).group_by(row.state)
    return dict(session.execute(counted).all())


def _keep_what_is_there(session: Session, experiment: str) -> None:
    """End the repetitions that wait: those with a point of the curve are COMPLETED with it, the others CANCELLED."""
    row = RepetitionRow
    kept = case((row.iterations_done > 0, State.COMPLETED), else_=State.CANCELLED)
    waiting = (row.experiment_id == experiment, row.state == State.QUEUED)
    session.execute(update(row).where(*waiting).values(state=kept, ended_at=now(), error=None))
