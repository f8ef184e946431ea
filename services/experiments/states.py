"""States: the one place that writes them, and what the states of repetitions mean for their experiment."""

from collections.abc import Iterable
from typing import Any

from sqlalchemy import ColumnElement, func, select, update
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import MOVES, State
from gaplab.services.core.errors import Conflict
from gaplab.services.store.clock import now
from gaplab.services.store.models import ExperimentRow, LeasedRow, RepetitionRow
from gaplab.services.store.queries.events import note

_CLAIMABLE = (State.QUEUED, State.RUNNING)

_FOLLOWING_EVENTS = {
    State.RUNNING: EventKind.STARTED,
    State.PAUSED: EventKind.PAUSED,
    State.COMPLETED: EventKind.COMPLETED,
    State.FAILED: EventKind.FAILED,
    State.CANCELLED: EventKind.CANCELLED,
}
"""The event of each move that follows from repetitions; the event of a requested move is noted with the request."""


def move(
    session: Session,
    table: type[ExperimentRow | LeasedRow],
    which: ColumnElement[bool],
    to: State,
    **values: Any,  # noqa: ANN401 - columns of any type
) -> list[Any]:
    """Move rows to a state in one statement, and return the ids of the rows that moved.

    A row whose state may not become `to` stays as it is. `ended_at` follows from the state.

    Args:
        session: of a transaction that writes.
        table: whose rows are moved.
        which: condition on these rows.
        to: their new state.
        values: further columns to set.
    """
    sources = [state for state, targets in MOVES.items() if to in targets]
    ended_at = now() if to.ended else None
    moved = update(table).where(which, table.state.in_(sources)).values(state=to, ended_at=ended_at, **values)
    return list(session.scalars(moved.returning(table.id)))


def settle(session: Session, experiments: Iterable[str], requested: State | None = None) -> None:
    """Bring experiments in line with their repetitions, whenever one of them has moved or a state is requested.

    An experiment without a repetition left to run ends. A PAUSING one becomes PAUSED when its last running step is
    over. A STOPPING one keeps no queued repetition. The counts that decide about turns are kept here and nowhere else.

    Args:
        session: of a transaction that has locked these experiments.
        experiments: their ids.
        requested: the state that a person asks for, to be entered or passed through; None without a request.

    Raises:
        Conflict: the experiment may not move to the state that follows.
    """
    for experiment in experiments:
        _settle(session, experiment, requested)


def _settle(session: Session, experiment: str, requested: State | None) -> None:
    row = ExperimentRow
    stored, limit = session.execute(select(row.state, row.max_parallel).where(row.id == experiment)).one()
    state = requested or stored
    if state is State.STOPPING:
        _end_queued(session, experiment)
    counts = _counts(session, experiment)
    queued, running = counts.get(State.QUEUED, 0), counts.get(State.RUNNING, 0)
    following = _following(state, queued, running, set(counts))
    claimable = following in _CLAIMABLE and queued > 0 and (limit is None or running < limit)
    values = {"running": running, "claimable": claimable}
    if following is not state:
        note(session, _FOLLOWING_EVENTS[following], experiment)
    if following is stored:
        session.execute(update(row).where(row.id == experiment).values(values))
    elif not move(session, row, row.id == experiment, following, **values):
        msg = f"experiment {experiment!r} is {stored} and cannot become {following}"
        raise Conflict(msg)


def _following(state: State, queued: int, running: int, states: set[State]) -> State:
    """Return the state that follows for an experiment from its repetitions.

    Args:
        state: of the experiment, stored or requested.
        queued: number of queued repetitions.
        running: number of running repetitions.
        states: of all repetitions.
    """
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


def _end_queued(session: Session, experiment: str) -> None:
    """End the queued repetitions: COMPLETED with a point of the curve, CANCELLED without one."""
    row = RepetitionRow
    queued = (row.experiment_id == experiment) & (row.state == State.QUEUED)
    move(session, row, queued & (row.iterations_done > 0), State.COMPLETED, error=None)
    move(session, row, queued, State.CANCELLED, error=None)
