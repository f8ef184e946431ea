"""Heartbeats of supervisors. Each function raises StoreUnavailable while the database cannot be used."""

from datetime import datetime, timedelta

from sqlalchemy import delete, update

from gaplab.services.running import execution, sensitivity
from gaplab.services.store.clock import moment, now
from gaplab.services.store.database_errors import StoreChanged
from gaplab.services.store.models import SupervisorRow
from gaplab.services.store.session import Session, Store, transaction

FORGET_AFTER = timedelta(days=1)
"""Age of the last heartbeat after which a supervisor is forgotten."""


@transaction
def heartbeat(session: Session, owner: str, last: datetime | None = None) -> datetime:
    """Record that the supervisor is alive now, with or without work, and return the time of the record.

    Raises:
        StoreChanged: the `last` heartbeat is missing, so this is not the database that it was written to.
    """
    row = SupervisorRow
    noted = update(row).where(row.owner == owner).values(heartbeat_at=now()).returning(row.heartbeat_at)
    if last is not None:
        noted = noted.where(row.heartbeat_at >= last)
    if (present := session.scalar(noted)) is not None:
        return present
    if last is not None:
        raise StoreChanged("the database lacks this supervisor's latest heartbeat: it was replaced or restored")
    present = moment(session)
    forgotten = (row.heartbeat_at < present - FORGET_AFTER) | (row.heartbeat_at > present + FORGET_AFTER)
    session.execute(delete(row).where(forgotten))
    session.add(row(owner=owner, started_at=present, heartbeat_at=present))
    return present


@transaction
def end(session: Session, owner: str) -> None:
    """Forget a supervisor that has shut down in order."""
    session.execute(delete(SupervisorRow).where(SupervisorRow.owner == owner))


def release(store: Store, owner: str, reason: str) -> int:
    """Requeue a dead supervisor's work, forget the supervisor, and return the number of pieces of work.

    Work that holds hardware stays until its lease runs out.
    """
    released = execution.release_all(store, owner, reason) + sensitivity.release_all(store, owner, reason)
    end(store, owner)
    return released
