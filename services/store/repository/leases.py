"""Leases: who may go on with a repetition.

A lease ends when its holder ends the repetition, gives it back, or is not heard of for too long. The next lease has the
next epoch, so that a holder who wakes up late cannot write.
"""

from collections.abc import Sequence
from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, case, func, select, tuple_, update
from sqlalchemy.orm import Session

from schemas.events import EventKind
from schemas.lifecycle import State
from schemas.provenance import Provenance
from schemas.spec import ExperimentSpec
from services.core.errors import Conflict
from services.store.clock import now
from services.store.lease import Claim
from services.store.models import ExperimentRow, RepetitionRow
from services.store.repository import provenance
from services.store.repository.events import note, note_losses
from services.store.repository.experiments import lock
from services.store.repository.steps import logs, mine

MAX_LOSSES = 5
"""A repetition that loses its worker so often without recording a step in between is what kills them."""

_OPEN = (State.QUEUED, State.RUNNING)


def claim(session: Session, owner: str, limit: int, under: Provenance) -> tuple[Claim, ...]:
    """Up to `limit` queued repetitions, of the oldest experiments first; RUNNING from now on, and the owner's.

    Experiments that were computed with something else than what it is under are left alone, and say so.
    """
    experiments = _oldest_with_queued(session, limit, under)
    if len(experiments) < limit:
        provenance.refuse(session, under)
    if not experiments:
        return ()
    lock(session, experiments)
    row = RepetitionRow
    queued = (
        select(row.id)
        .join(ExperimentRow, ExperimentRow.id == row.experiment_id)
        .where(row.experiment_id.in_(experiments), row.state == State.QUEUED, provenance.permitted(under))
        .order_by(ExperimentRow.created_at, ExperimentRow.position, ExperimentRow.id, row.number)
        .limit(limit)
    )
    ids = session.scalars(queued).all()
    session.execute(
        update(row)
        .where(row.id.in_(ids), row.state == State.QUEUED)
        .values(
            state=State.RUNNING,
            owner=owner,
            epoch=row.epoch + 1,
            attempts=row.attempts + 1,
            heartbeat_at=now(),
            started_at=func.coalesce(row.started_at, now()),
        )
    )
    _start(session, experiments, ids)
    claims = _claims(session, ids)
    provenance.record(session, under, claims)
    return claims


def heartbeat(session: Session, claims: Sequence[Claim]) -> tuple[Claim, ...]:
    """The claims that still hold, and hold on from now."""
    row = RepetitionRow
    alive = session.execute(
        update(row)
        .where(_any_of(claims), row.state == State.RUNNING)
        .values(heartbeat_at=now())
        .returning(row.id, row.epoch)
    )
    held = {(repetition, epoch) for repetition, epoch in alive}
    return tuple(each for each in claims if (each.repetition_id, each.epoch) in held)


def complete(session: Session, claims: Sequence[Claim]) -> tuple[Claim, ...]:
    """The repetitions COMPLETED; those of the claims that held.

    Raises:
        Conflict: some iterations of one of them are missing.
    """
    experiments = sorted({each.experiment_id for each in claims})
    lock(session, experiments)
    _refuse_unfinished(session, claims)
    row = RepetitionRow
    ended = session.execute(
        update(row)
        .where(_any_of(claims), row.state == State.RUNNING)
        .values(state=State.COMPLETED, error=None, ended_at=now())
        .returning(row.id)
    )
    held = set(ended.scalars())
    kept = tuple(each for each in claims if each.repetition_id in held)
    for each in kept:
        note(session, EventKind.REPETITION_COMPLETED, each.experiment_id, each.number)
    for experiment in experiments:
        _settle(session, experiment)
    return kept


def fail(session: Session, claim: Claim, reason: str) -> bool:
    """The repetition FAILED for a reason; False if the claim holds no more."""
    lock(session, [claim.experiment_id])
    row = RepetitionRow
    values = {"state": State.FAILED, "error": plain(reason), "ended_at": now()}
    ended = session.execute(update(row).where(mine(claim)).values(values).returning(row.id)).first()
    if ended is not None:
        note(session, EventKind.REPETITION_FAILED, claim.experiment_id, claim.number, reason=plain(reason))
    _settle(session, claim.experiment_id)
    return ended is not None


def release(session: Session, claim: Claim, reason: str) -> bool:
    """The repetition QUEUED again, for its worker was lost; False if the claim holds no more."""
    lock(session, [claim.experiment_id])
    return bool(_give_back(session, mine(claim), [claim.experiment_id], plain(reason)))


def hand_back(session: Session, claim: Claim) -> bool:
    """The repetition QUEUED again as if it had not been claimed; False if the claim holds no more."""
    lock(session, [claim.experiment_id])
    row = RepetitionRow
    values = {"state": State.QUEUED, "owner": None, "attempts": row.attempts - 1}
    held = session.execute(update(row).where(mine(claim)).values(values).returning(row.id)).first() is not None
    if held:
        note(session, EventKind.REPETITION_HANDED_BACK, claim.experiment_id, claim.number)
    return held


def requeue_lost(session: Session, stale_after: timedelta) -> int:
    """Every repetition whose holder was not heard of for so long QUEUED again; how many they were."""
    row = RepetitionRow
    before: datetime = session.execute(select(now())).scalar_one() - stale_after
    stale = (row.state == State.RUNNING) & (row.heartbeat_at < before)
    experiments = session.scalars(select(row.experiment_id).where(stale).distinct()).all()
    if not experiments:
        return 0
    lock(session, experiments)
    return _give_back(session, stale, experiments, f"its worker was not heard of for {stale_after.total_seconds():g} s")


def _oldest_with_queued(session: Session, limit: int, under: Provenance) -> Sequence[str]:
    row = ExperimentRow
    queued = select(RepetitionRow.experiment_id).where(RepetitionRow.state == State.QUEUED)
    return session.scalars(
        select(row.id)
        .where(row.id.in_(queued), row.state.in_(_OPEN), provenance.permitted(under))
        .order_by(row.created_at, row.position, row.id)
        .limit(limit)
    ).all()


def _start(session: Session, experiments: Sequence[str], repetitions: Sequence[int]) -> None:
    """Move the experiments of these repetitions to RUNNING, unless they are."""
    row = ExperimentRow
    of_these = select(RepetitionRow.experiment_id).where(RepetitionRow.id.in_(repetitions))
    started = session.scalars(
        update(row)
        .where(row.id.in_(experiments), row.id.in_(of_these), row.state == State.QUEUED)
        .values(state=State.RUNNING, started_at=now())
        .returning(row.id)
    )
    for experiment in started:
        note(session, EventKind.STARTED, experiment)


def _claims(session: Session, ids: Sequence[int]) -> tuple[Claim, ...]:
    row = RepetitionRow
    found = session.execute(
        select(row.id, row.epoch, row.experiment_id, row.number, ExperimentRow.spec)
        .join(ExperimentRow, ExperimentRow.id == row.experiment_id)
        .where(row.id.in_(ids))
        .order_by(ExperimentRow.created_at, ExperimentRow.position, ExperimentRow.id, row.number)
    ).all()
    specs = {experiment: ExperimentSpec.model_validate(spec) for _, _, experiment, _, spec in found}
    past = logs(session, ids)
    return tuple(
        Claim(repetition, epoch, experiment, number, specs[experiment], past[repetition])
        for repetition, epoch, experiment, number, _ in found
    )


def _give_back(session: Session, which: ColumnElement[bool], experiments: Sequence[str], reason: str) -> int:
    """QUEUED again, or FAILED where it was lost too often."""
    row = RepetitionRow
    hopeless = row.losses + 1 >= MAX_LOSSES
    failed = f"lost {MAX_LOSSES} times without a step in between; the last time {reason}"
    moved = session.execute(
        update(row)
        .where(which)
        .values(
            state=case((hopeless, State.FAILED), else_=State.QUEUED),
            error=case((hopeless, failed), else_=reason),
            ended_at=case((hopeless, now()), else_=None),
            losses=row.losses + 1,
            owner=None,
        )
        .returning(row.experiment_id, row.number, row.state, row.error)
    ).all()
    note_losses(session, moved)
    for experiment in experiments:
        _settle(session, experiment)
    return len(moved)


def _any_of(claims: Sequence[Claim]) -> ColumnElement[bool]:
    row = RepetitionRow
    return tuple_(row.id, row.epoch).in_([(each.repetition_id, each.epoch) for each in claims])


def _refuse_unfinished(session: Session, claims: Sequence[Claim]) -> None:
    row = RepetitionRow
    unfinished = session.execute(
        select(row.number, row.experiment_id, ExperimentRow.iterations - row.iterations_done)
        .join(ExperimentRow, ExperimentRow.id == row.experiment_id)
        .where(_any_of(claims), row.state == State.RUNNING, ExperimentRow.iterations != row.iterations_done)
    ).first()
    if unfinished is not None:
        number, experiment, missing = unfinished
        msg = f"repetition {number} of {experiment!r} is not complete: {missing} iterations are missing"
        raise Conflict(msg)


def plain(reason: str) -> str:
    """The reason in characters that any database stores, whatever the message of an exception had."""
    return reason.encode(errors="replace").decode().replace("\0", "?")


def _settle(session: Session, experiment: str) -> None:
    """End the experiment when its last repetition has ended; it is locked."""
    row = RepetitionRow
    states = set(session.scalars(select(row.state).where(row.experiment_id == experiment).distinct()))
    if states & set(_OPEN):
        return
    state = State.COMPLETED if State.COMPLETED in states else State.FAILED
    ended = session.execute(
        update(ExperimentRow)
        .where(ExperimentRow.id == experiment, ExperimentRow.state == State.RUNNING)
        .values(state=state, ended_at=now())
        .returning(ExperimentRow.id)
    ).first()
    if ended is not None:
        note(session, EventKind(state.lower()), experiment)
