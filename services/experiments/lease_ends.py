"""Ends of leases: which holder was silent for too long, and what the end of a repetition's lease changes."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from time import monotonic
from typing import Any, Generic, TypeVar

from sqlalchemy import ColumnElement, select, update
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import PERMITTED, Ending, State, Verb
from gaplab.services.core.errors import Conflict
from gaplab.services.experiments.states import move, settle
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries import attempts, checkpoints
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import lock

K = TypeVar("K", bound=Hashable)

_PAUSABLE = PERMITTED[Verb.PAUSE]

_REQUESTED_ENDINGS = {State.PAUSING: Ending.PAUSED, State.STOPPING: Ending.STOPPED}


class Silences(Generic[K]):
    """The heartbeats that one supervisor has seen, and since when each has stayed the same.

    A time in the database says too little about hardware: if somebody sets the database's clock, every lease seems to
    have expired, and a second holder would move a robot that the first still moves. So a supervisor waits until a
    heartbeat has not changed for a whole lease of its own monotonic clock.
    """

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        self._clock = clock
        self._since: dict[tuple[K, datetime], float] = {}

    def forget(self) -> None:
        """Begin anew, as after a time in which nobody could send a heartbeat."""
        self._since = {}

    def longer_than_leases(self, held: Sequence[tuple[K, datetime, float]]) -> list[tuple[K, datetime]]:
        """Return the ids and heartbeats of what was not heard of for a whole lease.

        Args:
            held: id, time of the last heartbeat and seconds of the lease of each; others are forgotten.
        """
        present = self._clock()
        self._since = {(id_, beat): self._since.get((id_, beat), present) for id_, beat, _ in held}
        return [(id_, beat) for id_, beat, lease_s in held if present - self._since[id_, beat] > lease_s]


@dataclass(frozen=True)
class Change:
    """The change of a row when its lease ends.

    Attributes:
        to: next state of the row.
        ending: kind of the end, for the list of attempts.
        reason: reason of the end, for the list of attempts.
        values: further columns to set.
    """

    to: State
    ending: Ending
    reason: str | None = None
    values: Mapping[str, Any] = field(default_factory=dict)


def end_repetitions(session: Session, which: ColumnElement[bool], change: Change) -> list[int]:
    """End the leases of running repetitions with their attempts, change their rows and experiments; return their ids.

    If an experiment is being paused or stopped, a hand-back is recorded as that.

    Raises:
        Conflict: a repetition that should become COMPLETED lacks iterations.
    """
    row = RepetitionRow
    held = select(row.id, row.experiment_id).where(which, row.state == State.RUNNING)
    owners = dict(session.execute(held).all())
    if not owners:
        return []
    states = lock(session, sorted(set(owners.values())))
    if change.to is State.COMPLETED:
        _refuse_unfinished(session, which)
    change = replace(change, values={"hardware": None, "measuring_at": None} | dict(change.values))
    ended: list[int] = move(
        session, row, which & row.id.in_(owners) & (row.state == State.RUNNING), change.to, **change.values
    )
    requested = _REQUESTED_ENDINGS if change.ending is Ending.HANDED_BACK else {}
    endings = {id_: requested.get(states[owners[id_]], change.ending) for id_ in ended}
    for each in Ending:
        if ids := [id_ for id_ in ended if endings[id_] is each]:
            attempts.end(session, ids, each, change.reason)
    if change.to is State.FAILED:
        checkpoints.forget(session, ended)
    settle(session, states)
    return ended


def take_back(
    session: Session, repetition: RepetitionRow, to: State, ending: Ending, reason: str | None = None
) -> None:
    """End the lease of a repetition if a worker holds one, and read its row again."""
    if repetition.state is State.RUNNING:
        change = Change(to, ending, reason, {"owner": None})
        end_repetitions(session, RepetitionRow.id == repetition.id, change)
        session.refresh(repetition)


def pause(session: Session, experiment: str, reason: str) -> None:
    """Pause an experiment for a reason that a person should see; one that is ending ends."""
    row = ExperimentRow
    state = lock(session, [experiment]).get(experiment)
    if state not in (*_PAUSABLE, State.PAUSING, State.PAUSED):
        return
    session.execute(update(row).where(row.id == experiment).values(paused_because=reason))
    if state in _PAUSABLE:
        note(session, EventKind.PAUSING, experiment, reason=reason)
        settle(session, [experiment], State.PAUSING)


def _refuse_unfinished(session: Session, which: ColumnElement[bool]) -> None:
    row = RepetitionRow
    unfinished = session.execute(
        select(row.number, row.experiment_id, ExperimentRow.iterations - row.iterations_done)
        .join(ExperimentRow, ExperimentRow.id == row.experiment_id)
        .where(which, row.state == State.RUNNING, ExperimentRow.iterations != row.iterations_done)
    ).first()
    if unfinished is not None:
        number, experiment, missing = unfinished
        raise Conflict(f"repetition {number} of {experiment!r} is not complete: {missing} iterations are missing")
