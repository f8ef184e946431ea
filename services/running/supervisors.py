"""Heartbeats of supervisors. Each function is one transaction, and raises StoreUnavailable."""

from datetime import timedelta

from sqlalchemy import delete, update

from gaplab.services.store.clock import moment, now
from gaplab.services.store.models import SupervisorRow
from gaplab.services.store.session import Session, transaction

FORGET_AFTER = timedelta(days=1)
"""Age of the last heartbeat after which a supervisor is forgotten."""


@transaction
def heartbeat(session: Session, owner: str) -> None:
    """Record that the supervisor is alive now, with or without work."""
    row = SupervisorRow
    beaten = session.execute(update(row).where(row.owner == owner).values(heartbeat_at=now()).returning(row.owner))
    if beaten.first() is None:
        session.execute(delete(row).where(row.heartbeat_at < moment(session) - FORGET_AFTER))
        session.add(row(owner=owner))


@transaction
def end(session: Session, owner: str) -> None:
    """Forget a supervisor that has shut down in order."""
    session.execute(delete(SupervisorRow).where(SupervisorRow.owner == owner))
