"""The lease of a repetition: its end changes the attempt, the experiment and the hardware."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from sqlalchemy import ColumnElement, select, update
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import PERMITTED, Ending, State, Verb
from gaplab.services.core.errors import Conflict
from gaplab.services.experiments.states import settle
from gaplab.services.running.leases import MAX_LOSSES, Change, Leases
from gaplab.services.store.lease import Claim
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries import attempts, checkpoints
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import lock

_PAUSABLE = PERMITTED[Verb.PAUSE]

_REQUESTED_ENDINGS = {State.PAUSING: Ending.PAUSED, State.STOPPING: Ending.STOPPED}


class RepetitionLeases(Leases[Claim]):
    """Leases of repetitions. When one ends, its attempt and its experiment are updated."""

    table = RepetitionRow

    def taken(self) -> Mapping[str, Any]:
        """Return the columns that a claim sets: it holds the hardware, and measures nothing yet."""
        experiment = ExperimentRow
        hardware = select(experiment.hardware).where(experiment.id == RepetitionRow.experiment_id).scalar_subquery()
        return {"measuring_at": None, "hardware": hardware}

    def lose(self, session: Session, which: ColumnElement[bool], reason: str) -> list[Any]:
        """Queue lost work again as the base does, but do not blame a plug-in for a measurement that was cut off.

        If measurements are cut off repeatedly, the experiment is paused, because a person must look.
        """
        row = self.table
        values = {"losses": row.losses + 1, "owner": None, "error": reason}
        change = Change(State.QUEUED, Ending.LOST, reason, values)
        cut_off = self.end(session, which & row.measuring_at.is_not(None), change)
        often = select(row.experiment_id, row.losses).where(row.id.in_(cut_off), row.losses >= MAX_LOSSES)
        for experiment, losses in session.execute(often).all():
            pause(session, experiment, f"a measurement was cut off {losses} times; the last time {reason}")
        return cut_off + super().lose(session, which, reason)

    def drives(self) -> ColumnElement[bool]:
        """Return the SQL condition: the repetition holds hardware, which its worker may still drive for a moment."""
        return self.table.hardware.is_not(None)

    def free_lost(self, session: Session, stale: ColumnElement[bool]) -> None:
        """Free the hardware of ended leases whose supervisor never reported that its worker has stopped."""
        row = self.table
        session.execute(update(row).where(stale, row.state != State.RUNNING, self.drives()).values(hardware=None))

    def end(self, session: Session, which: ColumnElement[bool], change: Change) -> list[int]:
        """End leases as the base does; if the experiment is being paused or stopped, a hand-back is recorded as that.

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
        ended: list[int] = super().end(session, which & row.id.in_(owners), change)
        requested = _REQUESTED_ENDINGS if change.ending is Ending.HANDED_BACK else {}
        endings = {id_: requested.get(states[owners[id_]], change.ending) for id_ in ended}
        for each in Ending:
            if ids := [id_ for id_ in ended if endings[id_] is each]:
                attempts.end(session, ids, each, change.reason)
        if change.to is State.FAILED:
            checkpoints.forget(session, ended)
        settle(session, states)
        return ended


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
