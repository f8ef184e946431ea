"""Leases: who may go on with a repetition.

A lease ends when its holder ends the repetition, gives it back, or is not heard of for too long. The next lease has the
next epoch, so that a holder who wakes up late cannot write.
"""

from collections.abc import Sequence
from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, case, func, select, update
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import Ending, State
from gaplab.schemas.provenance import Provenance
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.errors import Conflict
from gaplab.services.store.clock import now
from gaplab.services.store.lease import Claim
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries import attempts, checkpoints, provenance
from gaplab.services.store.queries.experiments import lock
from gaplab.services.store.queries.settling import settle
from gaplab.services.store.queries.steps import any_of, logs, mine
from gaplab.services.store.queries.turns import next_repetitions

MAX_LOSSES = 5
"""A repetition that loses its worker so often without recording a step in between is what kills them."""


def claim(session: Session, owner: str, limit: int, under: Provenance) -> tuple[Claim, ...]:
    """Up to `limit` queued repetitions, whose turn it is; RUNNING from now on, and the owner's.

    Experiments that were computed with something else than what it is under are left alone, and say so.
    """
    ids = next_repetitions(session, limit, provenance.permitted(session, under))
    if len(ids) < limit:
        provenance.refuse(session, under)
    if not ids:
        return ()
    row = RepetitionRow
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
    attempts.begin(session, ids)
    claims = _claims(session, ids)
    _start(session, sorted({each.experiment_id for each in claims}))
    provenance.record(session, under, claims)
    return claims


def heartbeat(session: Session, claims: Sequence[Claim]) -> tuple[Claim, ...]:
    """The claims that still hold, and hold on from now."""
    row = RepetitionRow
    alive = session.execute(
        update(row)
        .where(any_of(claims), row.state == State.RUNNING)
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
        .where(any_of(claims), row.state == State.RUNNING)
        .values(state=State.COMPLETED, error=None, ended_at=now())
        .returning(row.id)
    )
    held = set(ended.scalars())
    attempts.end(session, sorted(held), Ending.COMPLETED)
    settle(session, experiments)
    return tuple(each for each in claims if each.repetition_id in held)


def fail(session: Session, claim: Claim, reason: str) -> bool:
    """The repetition FAILED for a reason; False if the claim holds no more."""
    lock(session, [claim.experiment_id])
    row = RepetitionRow
    values = {"state": State.FAILED, "error": plain(reason), "ended_at": now()}
    ended = session.scalars(update(row).where(mine(claim)).values(values).returning(row.id)).all()
    attempts.end(session, ended, Ending.FAILED, plain(reason))
    checkpoints.forget(session, ended)
    settle(session, [claim.experiment_id])
    return bool(ended)


def release(session: Session, claim: Claim, reason: str) -> bool:
    """The repetition QUEUED again, for its worker was lost; False if the claim holds no more."""
    lock(session, [claim.experiment_id])
    return bool(_give_back(session, mine(claim), [claim.experiment_id], plain(reason)))


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


def _start(session: Session, experiments: Sequence[str]) -> None:
    """These experiments run, since now unless they have before."""
    row = ExperimentRow
    session.execute(update(row).where(row.id.in_(experiments)).values(started_at=func.coalesce(row.started_at, now())))
    settle(session, experiments)


def _claims(session: Session, ids: Sequence[int]) -> tuple[Claim, ...]:
    """The claims to these repetitions, in their order."""
    row = RepetitionRow
    found = session.execute(
        select(row.id, row.epoch, row.experiment_id, row.number, ExperimentRow.spec)
        .join(ExperimentRow, ExperimentRow.id == row.experiment_id)
        .where(row.id.in_(ids))
    ).all()
    specs = {experiment: ResolvedSpec.model_validate(spec) for _, _, experiment, _, spec in found}
    past, begun = logs(session, ids), checkpoints.stored(session, ids)
    claims = {
        repetition: Claim(repetition, epoch, experiment, number, specs[experiment], past[repetition], begun[repetition])
        for repetition, epoch, experiment, number, _ in found
    }
    return tuple(claims[each] for each in ids)


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
        .returning(row.id, row.state)
    ).all()
    attempts.end(session, [id_ for id_, _ in moved], Ending.LOST, reason)
    checkpoints.forget(session, [id_ for id_, state in moved if state is State.FAILED])
    settle(session, experiments)
    return len(moved)


def _refuse_unfinished(session: Session, claims: Sequence[Claim]) -> None:
    row = RepetitionRow
    unfinished = session.execute(
        select(row.number, row.experiment_id, ExperimentRow.iterations - row.iterations_done)
        .join(ExperimentRow, ExperimentRow.id == row.experiment_id)
        .where(any_of(claims), row.state == State.RUNNING, ExperimentRow.iterations != row.iterations_done)
    ).first()
    if unfinished is not None:
        number, experiment, missing = unfinished
        msg = f"repetition {number} of {experiment!r} is not complete: {missing} iterations are missing"
        raise Conflict(msg)


def plain(reason: str) -> str:
    """The reason in characters that any database stores, whatever the message of an exception had."""
    return reason.encode(errors="replace").decode().replace("\0", "?")
