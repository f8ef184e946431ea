"""Attempts at repetitions: their supervisors, times and endings."""

from datetime import datetime

from sqlalchemy import ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.schemas.lifecycle import Ending
from gaplab.services.store.models.base import Base, Reason


class AttemptRow(Base):
    """One lease of a repetition. At most one has not ended: the valid one.

    Attributes:
        epoch: epoch of the lease, which numbers the attempts of a repetition from 1.
        ended_at, ending: NULL while the lease is valid.
        reason: reason of a failure or a loss.
        hidden_reason: as `hidden_error` of a repetition.
    """

    __tablename__ = "attempt"

    repetition_id: Mapped[int] = mapped_column(ForeignKey("repetition.id"), primary_key=True)
    epoch: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    owner: Mapped[str] = mapped_column(String(200))
    started_at: Mapped[datetime]
    ended_at: Mapped[datetime | None]
    ending: Mapped[Ending | None]
    reason: Mapped[str | None] = mapped_column(Reason)
    hidden_reason: Mapped[str | None] = mapped_column(Reason)
