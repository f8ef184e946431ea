"""Work under a lease: the columns that its kinds share, sensitivity checks, attempts, and checkpoints."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, ForeignKey, Index, String
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.schemas.lifecycle import Ending, State
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


class CheckpointRow(Base):
    """A part of one step. It is deleted once the step is recorded; without it, only time is lost.

    Attributes:
        step: place of the step in the log of its repetition.
        part: number of the part within the step.
        answers: digests and fitnesses, packed by `gaplab.services.core.answers`; no other module reads them.
        seconds: seconds of work that they took.
        rollouts, budget: rollouts of the step so far, and those that it was given.
    """

    __tablename__ = "checkpoint"

    repetition_id: Mapped[int] = mapped_column(ForeignKey("repetition.id"), primary_key=True, autoincrement=False)
    step: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    part: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    answers: Mapped[bytes]
    seconds: Mapped[float]
    rollouts: Mapped[int] = mapped_column(BigInteger, server_default="0")
    budget: Mapped[int] = mapped_column(BigInteger, server_default="0")


class SensitivityRow(LeasedRow):
    """A sensitivity check, with its lease.

    Attributes:
        id: hash of the spec, so that equal subjects are checked once.
        spec: robot, engine and tunables, and the size of the check.
        found: effect of each tunable on fitness; NULL until it is known.
    """

    __tablename__ = "sensitivity"
    __table_args__ = (Index(None, "state", "created_at"),)

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    spec: Mapped[dict[str, Any]]
    found: Mapped[list[dict[str, Any]] | None]
    created_at: Mapped[datetime]
