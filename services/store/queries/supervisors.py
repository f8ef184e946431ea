"""Supervisors that work on this database."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from gaplab.services.store.clock import moment
from gaplab.services.store.models import SupervisorRow


def ages(session: Session) -> tuple[float, ...]:
    """Return the seconds since each supervisor's last heartbeat, without those that shut down in order.

    A heartbeat from the future was sent before the clock was set back. It counts as old as it is far away.
    """
    present = moment(session)
    beats = session.scalars(select(SupervisorRow.heartbeat_at))
    return tuple(abs((present - beat).total_seconds()) for beat in beats)
