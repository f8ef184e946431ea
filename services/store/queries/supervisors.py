"""Supervisors that work on this database."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from gaplab.services.store.clock import moment
from gaplab.services.store.models import SupervisorRow


def ages(session: Session) -> tuple[float, ...]:
    """Return the seconds since each supervisor's last heartbeat, without those that shut down in order."""
    present = moment(session)
    return tuple((present - beat).total_seconds() for beat in session.scalars(select(SupervisorRow.heartbeat_at)))
