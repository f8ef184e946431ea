"""Supervisors: who works on this database, and when each was last heard of."""

from datetime import timedelta

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from gaplab.services.store.clock import now
from gaplab.services.store.models import SupervisorRow

FORGET_AFTER = timedelta(days=1)
"""One that was not heard of for so long is of no interest any more."""


def heartbeat(session: Session, owner: str) -> None:
    """The supervisor works, as of now."""
    row = SupervisorRow
    beaten = session.execute(update(row).where(row.owner == owner).values(heartbeat_at=now()).returning(row.owner))
    if beaten.first() is None:
        before = session.execute(select(now())).scalar_one() - FORGET_AFTER
        session.execute(delete(row).where(row.heartbeat_at < before))
        session.add(row(owner=owner))


def end(session: Session, owner: str) -> None:
    """The supervisor has stopped in good order."""
    session.execute(delete(SupervisorRow).where(SupervisorRow.owner == owner))


def ages(session: Session) -> tuple[float, ...]:
    """Seconds since each supervisor was last heard of; of those that stopped in good order, nothing."""
    row = SupervisorRow
    moment = session.execute(select(now())).scalar_one()
    return tuple((moment - each).total_seconds() for each in session.scalars(select(row.heartbeat_at)))
