"""Work under a lease: columns that repetitions, sensitivity checks and later kinds of work share."""

from datetime import datetime
from typing import Any

from sqlalchemy import String
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.schemas.lifecycle import State
from gaplab.services.store.models.base import Base, Reason


class LeasedRow(Base):
    """A piece of work that one supervisor at a time may hold.

    Attributes:
        owner: the supervisor that holds the lease, or held it last.
        epoch: epoch of the lease; every write of a holder has it, and a write with an old epoch changes nothing.
        heartbeat_at: time of the holder's latest heartbeat.
        attempts: number of claims that were not handed back.
        losses: number of workers lost since the last progress.
        error: reason why it FAILED or was last queued again.
    """

    __abstract__ = True

    id: Mapped[Any]
    state: Mapped[State] = mapped_column(default=State.QUEUED)
    owner: Mapped[str | None] = mapped_column(String(200))
    epoch: Mapped[int] = mapped_column(default=0)
    heartbeat_at: Mapped[datetime | None]
    attempts: Mapped[int] = mapped_column(default=0)
    losses: Mapped[int] = mapped_column(default=0)
    error: Mapped[str | None] = mapped_column(Reason)
    started_at: Mapped[datetime | None]
    ended_at: Mapped[datetime | None]
