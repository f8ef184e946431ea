"""Execution of repetitions: claims in the order of turns, records of steps, and ends.

The lease mechanism is that of `gaplab.services.running.leases`. People's requests are handled here, so they do not
depend on the holder: the first new step after a pause or stop is stored, and ends the lease.

All functions raise StoreUnavailable while the database cannot be used; each may then be tried again.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from sqlalchemy import ColumnElement, func, select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import ASKED, Ending, State
from gaplab.schemas.provenance import Provenance
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.types import Step
from gaplab.services.experiments.lease_ends import Change, end_repetitions, pause
from gaplab.services.experiments.states import settle
from gaplab.services.measuring.waiting import wait
from gaplab.services.running import provenance
from gaplab.services.running.leases import MAX_LOSSES, Leases
from gaplab.services.running.turns import FREE_HARDWARE, ahead, next_repetitions
from gaplab.services.running.versions import provenance as present_provenance
from gaplab.services.store.clock import now
from gaplab.services.store.lease import Claim, Delivered, Failure, Requested, TimedStep
from gaplab.services.store.models import AttemptRow, ExperimentRow, RepetitionRow
from gaplab.services.store.queries import attempts, checkpoints, files, steps
from gaplab.services.store.queries.experiments import lock
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Store, transaction
from gaplab.services.store.statements import storable


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
        """End leases as `end_repetitions` does."""
        return end_repetitions(session, which, change)


_LEASES = RepetitionLeases()

heartbeat = _LEASES.heartbeat
complete = _LEASES.complete
release = _LEASES.release
hand_back = _LEASES.hand_back
hand_back_unheard = _LEASES.hand_back_unheard
requeue_lost = _LEASES.requeue_lost
release_all = _LEASES.release_all


def fail(store: Store, claim: Claim, failure: Failure) -> bool:
    """End a repetition as FAILED; return False if the claim is no longer valid.

    If reality failed, queue the repetition instead, and pause its experiment until a person resumes it.
    """
    return store.write(_fail, claim, failure)


@transaction
def note_measuring(session: Session, claims: Sequence[Claim]) -> tuple[Claim, ...]:
    """Record that these repetitions wait for reality's answer, and return the claims that are still valid."""
    return _LEASES.renew(session, claims, measuring_at=now())


@transaction
def free_hardware(session: Session, claims: Sequence[Claim]) -> None:
    """Record that the workers of these ended claims have stopped, so that others may use their hardware."""
    row = RepetitionRow
    session.execute(update(row).where(_LEASES.of(claims), row.state != State.RUNNING).values(hardware=None))


def claim(
    store: Store,
    owner: str,
    limit: int,
    under: Provenance | None = None,
    refused: Mapping[str, str] = provenance.NONE,
) -> tuple[Claim, ...]:
    """Claim up to `limit` queued repetitions in the order of turns, and return them with their logs.

    An experiment that was begun under another engine, plug-in, architecture or version of the spec than `under`, which
    is this process's provenance if left out, is left alone, and says so. So are those that name plug-ins that are not
    available here, or that processes of the supervisor refuse, by kind and name.
    """
    try:
        return store.write(_claim, owner, limit, under or present_provenance(), refused) if limit > 0 else ()
    except IntegrityError as error:
        if "hardware" not in str(error.orig):
            raise
        return ()  # another supervisor took the same hardware at the same moment


def record(store: Store, claim: Claim, step: Step, *, seconds: float = 0.0) -> bool:
    """Append a step to the repetition's log, as `record_all` does, and return whether the claim is still valid."""
    return bool(record_all(store, [(claim, (TimedStep(step, seconds),))]))


def record_all(store: Store, deliveries: Iterable[tuple[Claim, Iterable[Delivered]]]) -> tuple[Claim, ...]:
    """Append steps to the logs of repetitions in one transaction, and return the claims that are still valid.

    A second delivery of a step changes nothing. A checkpoint is kept until its step is recorded. Nothing is written for
    a claim that does not hold. A claim whose experiment is being paused or stopped ends with its first new step, which
    is written. A claim that requests a measurement ends, and its repetition waits.

    Raises:
        Conflict: steps before a delivered one are missing; nothing was written.
    """
    by_claim: dict[Claim, list[Delivered]] = {}
    for claim, delivered in deliveries:
        by_claim.setdefault(claim, []).extend(delivered)
    return store.write(_record, by_claim) if by_claim else ()


def give_way(
    store: Store,
    waiting: Iterable[Claim],
    under: Provenance | None = None,
    refused: Mapping[str, str] = provenance.NONE,
) -> tuple[Claim, ...]:
    """Hand back claims of repetitions that wait for a core and should not start now, and return them.

    The reason is a request to pause or stop, or another experiment's turn, for which a running one is never
    interrupted. `under` and `refused` are as in `claim`.
    """
    claims = tuple(waiting)
    if not claims:
        return ()
    with store.reading() as session:
        permitted = provenance.permitted(session, under or present_provenance(), refused) & FREE_HARDWARE
        unwanted = _unwanted(session, claims, permitted)
    return hand_back(store, *unwanted)


def _fail(session: Session, claim: Claim, failure: Failure) -> bool:
    why, hidden = storable(failure.reason), storable(failure.hidden) if failure.hidden else None
    to = State.QUEUED if failure.of_reality else State.FAILED
    values = {"error": why, "hidden_error": hidden} | ({"owner": None} if failure.of_reality else {})
    if not _LEASES.end(session, _LEASES.of([claim]), Change(to, Ending.FAILED, why, values)):
        return False
    attempt = AttemptRow
    latest = (attempt.repetition_id == claim.id) & (attempt.epoch == claim.epoch)
    session.execute(update(attempt).where(latest).values(hidden_reason=hidden))
    if failure.of_reality:
        pause(session, claim.experiment_id, f"repetition {claim.number}: {why}")
    return True


def _claim(
    session: Session, owner: str, limit: int, under: Provenance, refused: Mapping[str, str] = provenance.NONE
) -> tuple[Claim, ...]:
    permitted = provenance.permitted(session, under, refused) & FREE_HARDWARE
    ids = next_repetitions(session, limit, permitted)
    while ids and (unusable := provenance.refuse_unusable(session, ids, refused)):
        permitted &= ExperimentRow.id.not_in(unusable)
        ids = next_repetitions(session, limit, permitted)
    if len(ids) < limit:
        provenance.refuse(session, under, refused)
    if not ids:
        return ()
    _LEASES.take(session, ids, owner)
    attempts.begin(session, ids)
    claims = _claims(session, ids)
    row, experiments = ExperimentRow, sorted({claim.experiment_id for claim in claims})
    moment = now()
    turn = {"started_at": func.coalesce(row.started_at, moment), "turn_at": moment}
    session.execute(update(row).where(row.id.in_(experiments)).values(turn))
    settle(session, experiments)
    provenance.record(session, under, claims)
    return claims


def _claims(session: Session, ids: Sequence[int]) -> tuple[Claim, ...]:
    row = RepetitionRow
    rows = session.execute(
        select(row.id, row.epoch, row.experiment_id, row.number, ExperimentRow.spec, row.owner)
        .join(ExperimentRow, ExperimentRow.id == row.experiment_id)
        .where(row.id.in_(ids))
    ).all()
    files.learn(session, (spec for *_, spec, _ in rows))
    specs = {experiment: ResolvedSpec.model_validate(spec) for _, _, experiment, _, spec, _ in rows}
    past, parts = logs(session, ids), checkpoints.stored(session, ids)
    claims = {
        id_: Claim(id_, epoch, experiment, number, specs[experiment], past[id_], parts[id_], owner=owner)
        for id_, epoch, experiment, number, _, owner in rows
    }
    return tuple(claims[id_] for id_ in ids)


def _record(session: Session, deliveries: Mapping[Claim, Sequence[Delivered]]) -> tuple[Claim, ...]:
    requested = _locked_requests(session, deliveries)
    held = steps.record(session, deliveries)
    asked = {claim: item for claim in held for item in deliveries[claim] if isinstance(item, Requested)}
    leaving = {
        claim.id
        for claim, new_steps in held.items()
        if (new_steps or claim in asked) and claim.experiment_id in requested
    }
    if leaving:
        row = RepetitionRow
        iterations = select(ExperimentRow.iterations).where(ExperimentRow.id == row.experiment_id).correlate(row)
        done = row.id.in_(leaving) & (row.iterations_done >= iterations.scalar_subquery())
        _LEASES.end(session, done, Change(State.COMPLETED, Ending.COMPLETED, values={"owner": None}))
        handed_back = Change(State.QUEUED, Ending.HANDED_BACK, values={"owner": None})
        _LEASES.end(session, row.id.in_(leaving), handed_back)
    asking = {claim: item for claim, item in asked.items() if claim.id not in leaving}
    wait(session, asking)
    return tuple(claim for claim in held if claim.id not in leaving and claim not in asking)


def _locked_requests(session: Session, claims: Iterable[Claim]) -> dict[str, State]:
    """Lock the experiments of these claims that people are pausing or stopping, and return their states.

    An experiment is always locked before its repetitions, so they are first read without a lock.
    """
    row = ExperimentRow
    requested = select(row.id).where(row.id.in_({claim.experiment_id for claim in claims}), row.state.in_(ASKED))
    states = lock(session, ids) if (ids := session.scalars(requested).all()) else {}
    return {experiment: state for experiment, state in states.items() if state in ASKED}


def _unwanted(session: Session, waiting: Sequence[Claim], permitted: ColumnElement[bool]) -> tuple[Claim, ...]:
    row, experiments = ExperimentRow, sorted({claim.experiment_id for claim in waiting})
    requested = session.scalars(select(row.id).where(row.id.in_(experiments), row.state.in_(ASKED))).all()
    gone = {*requested, *ahead(session, experiments, permitted)}
    return tuple(claim for claim in waiting if claim.experiment_id in gone)
