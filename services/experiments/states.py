"""States. Only this module writes them; the state of an experiment follows from its repetitions."""

from collections.abc import Collection, Iterable
from typing import Any

from sqlalchemy import ColumnElement, func, select, update
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import MOVES, State
from gaplab.services.core.errors import Conflict
from gaplab.services.store.clock import now
from gaplab.services.store.models import ExperimentRow, LeasedRow, RepetitionRow, RequestRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.requests import withdraw

_CLAIMABLE = (State.QUEUED, State.RUNNING)

_FOLLOWING_EVENTS = {
    State.RUNNING: EventKind.STARTED,
    State.WAITING: EventKind.WAITING,
    State.PAUSED: EventKind.PAUSED,
    State.COMPLETED: EventKind.COMPLETED,
    State.FAILED: EventKind.FAILED,
    State.CANCELLED: EventKind.CANCELLED,
}
"""The event of each move that follows from repetitions; a requested move has its event where the request is handled."""


def move(
    session: Session,
    table: type[ExperimentRow | LeasedRow],
    which: ColumnElement[bool],
    to: State,
    **values: Any,  # noqa: ANN401 - columns of any type
) -> list[Any]:
    """Move rows to a state in one statement, set further columns, and return the ids of the rows that moved.

    A row whose state may not become `to` stays as it is. `ended_at` follows from the state.
    """
    sources = [state for state, targets in MOVES.items() if to in targets]
    ended_at = now() if to.ended else None
    moved = update(table).where(which, table.state.in_(sources)).values(state=to, ended_at=ended_at, **values)
    return list(session.scalars(moved.returning(table.id)))


def settle(session: Session, experiments: Iterable[str], requested: State | None = None) -> None:
    """Update the states of locked experiments after a repetition has moved, or when a person requests a state.

    An experiment without a repetition left to run ends. A PAUSING one becomes PAUSED when its last running step is
    over. A STOPPING one keeps no queued repetition. Only this function keeps the counts that turns depend on.

    Raises:
        Conflict: the move to the resulting state is not permitted.
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
    following = _following(state, counts)
    claimable = following in _CLAIMABLE and queued > 0 and (limit is None or running < limit)
    values = {"running": running, "claimable": claimable}
    if following is not state and (state, following) != (State.WAITING, State.RUNNING):
        note(session, _FOLLOWING_EVENTS[following], experiment)
    if following is stored:
        session.execute(update(row).where(row.id == experiment).values(values))
    elif not move(session, row, row.id == experiment, following, **values):
        raise Conflict(f"experiment {experiment!r} is {stored} and cannot become {following}")


def _following(state: State, repetitions: Collection[State]) -> State:
    """Return the state of an experiment, stored or requested, that follows from those of its repetitions."""
    if state.ended:
        return state
    queued, running, waiting = (each in repetitions for each in (State.QUEUED, State.RUNNING, State.WAITING))
    if not (queued or running or waiting):
        return next((end for end in (State.COMPLETED, State.FAILED) if end in repetitions), State.CANCELLED)
    if state is State.PAUSING and not running:
        return State.PAUSED
    if state in (State.PAUSING, State.PAUSED, State.STOPPING):
        return state
    if not (queued or running):
        return State.WAITING
    return State.QUEUED if state is State.QUEUED and not running else State.RUNNING


def _counts(session: Session, experiment: str) -> dict[State, int]:
    row = RepetitionRow
    counted = select(row.state, func.count()).where(row.experiment_id == experiment).group_by(row.state)
    return dict(session.execute(counted).all())


def _end_queued(session: Session, experiment: str) -> None:
    """End the repetitions that do not run: COMPLETED with a point of the curve, CANCELLED without one."""
    row = RepetitionRow
    queued = (row.experiment_id == experiment) & row.state.in_((State.QUEUED, State.WAITING))
    ended = move(session, row, queued & (row.iterations_done > 0), State.COMPLETED, error=None)
    ended += move(session, row, queued, State.CANCELLED, error=None)
    withdraw(session, RequestRow.repetition_id.in_(ended))
