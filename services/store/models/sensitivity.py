"""Sensitivity checks."""

from datetime import datetime
from typing import Any

from sqlalchemy import (
    Index,
    String,
    Text,
)
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.schemas.lifecycle import State
from gaplab.services.store.models.base import Base


class SensitivityRow(Base):
    """A sensitivity check, with its lease.

    Attributes:
        id: follows from the spec, so that the same is checked once.
        spec: robot, engine and tunables, and how much is simulated.
        owner, epoch, heartbeat_at, attempts, losses, error: as of a repetition.
        found: what each tunable does to fitness; NULL until it is known.
    """

    __tablename__ = "sensitivity"
    __table_args__ = (Index(None, "state", "created_at"),)

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    spec: Mapped[dict[str, Any]]
    state: Mapped[State] = mapped_column(default=State.QUEUED)
    owner: Mapped[str | None] = mapped_column(String(200))
    epoch: Mapped[int] = mapped_column(default=0)
    heartbeat_at: Mapped[datetime | None]
    attempts: Mapped[int] = mapped_column(default=0)
    losses: Mapped[int] = mapped_column(default=0)
    error: Mapped[str | None] = mapped_column(Text)
    found: Mapped[list[dict[str, Any]] | None]
    created_at: Mapped[datetime]
    started_at: Mapped[datetime | None]
    ended_at: Mapped[datetime | None]
