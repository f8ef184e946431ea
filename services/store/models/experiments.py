"""What was submitted, and where it stands."""

from datetime import datetime
from typing import Any

from sqlalchemy import (
    BigInteger,
    ForeignKey,
    Index,
    String,
    Text,
    UniqueConstraint,
)
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.schemas.lifecycle import State
from gaplab.services.store.models.base import SPEC_VERSION, Base


class StudyRow(Base):
    """Experiments that belong together to be compared.

    Attributes:
        notes, edits: as of an experiment.
    """

    __tablename__ = "study"
    __table_args__ = (Index(None, "created_at", "id"), Index(None, "name", "id"))

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(200))
    notes: Mapped[str | None] = mapped_column(Text)
    edits: Mapped[int] = mapped_column(default=0, server_default="0")
    created_at: Mapped[datetime]


class ExperimentRow(Base):
    """One resolved spec.

    Attributes:
        position: within its study.
        spec: what makes its results.
        iterations: of one repetition, number 0 included.
        rollouts: expected of one repetition.
        precedence: its priority, negated: the least has its turn first, so that one index is in the order of turns.
        max_parallel: repetitions that run at once; NULL for any number.
        running: repetitions that somebody has claimed.
        claimable: whether one more may be claimed now. Both are kept by `repository/settling.py`.
        computed_with: engines, machine, version of the spec and plug-ins from outside, as its first steps had them.
        refused_by: what a supervisor has that did not go on with it, for it is not the same.
        sensitivity_id: of the check of what it tunes.
        token_id: of the token that submitted it; NULL where none is needed.
        notes: of people, about it.
        edits: how often people changed its name or notes.
    """

    __tablename__ = "experiment"
    __table_args__ = (
        Index(None, "created_at", "position", "id"),
        Index("ix_experiment_turn", "claimable", "precedence", "running", "created_at", "position", "id"),
        Index(None, "name", "id"),
        Index(None, "strategy", "id"),
        Index(None, "state", "id"),
        Index(None, "state", "created_at", "position", "id"),
        Index(None, "strategy", "created_at", "position", "id"),
    )

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    study_id: Mapped[str | None] = mapped_column(ForeignKey("study.id"), index=True)
    position: Mapped[int]
    name: Mapped[str] = mapped_column(String(200))
    strategy: Mapped[str] = mapped_column(String(100))
    state: Mapped[State] = mapped_column(default=State.QUEUED)
    spec: Mapped[dict[str, Any]]
    spec_version: Mapped[int] = mapped_column(default=SPEC_VERSION)
    iterations: Mapped[int]
    rollouts: Mapped[int] = mapped_column(BigInteger)
    precedence: Mapped[int] = mapped_column(default=0)
    max_parallel: Mapped[int | None]
    running: Mapped[int] = mapped_column(default=0)
    claimable: Mapped[bool] = mapped_column(default=True)
    computed_with: Mapped[str | None] = mapped_column(Text)
    refused_by: Mapped[str | None] = mapped_column(Text)
    sensitivity_id: Mapped[str | None] = mapped_column(String(32), index=True)
    token_id: Mapped[str | None] = mapped_column(String(32))
    notes: Mapped[str | None] = mapped_column(Text)
    edits: Mapped[int] = mapped_column(default=0, server_default="0")
    created_at: Mapped[datetime]
    started_at: Mapped[datetime | None]
    ended_at: Mapped[datetime | None]


class RepetitionRow(Base):
    """One run of the algorithm, with its lease and its tallies.

    Attributes:
        owner: who holds or held the lease.
        epoch: of the lease; every write of a holder carries it, and a write with an old one changes nothing.
        heartbeat_at: when the holder was last heard of.
        attempts: times that it was claimed.
        losses: times that its worker was lost since a step, or a part of one, was last recorded.
        steps: recorded so far; the position that the next step takes in the log.
        checkpoints: parts of that next step that are stored.
        seconds: of work in the recorded steps.
        provenance_id: under what it was claimed the last time.
    """

    __tablename__ = "repetition"
    __table_args__ = (
        UniqueConstraint("experiment_id", "number"),
        Index(None, "state", "heartbeat_at"),
        Index(None, "experiment_id", "state", "number"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    experiment_id: Mapped[str] = mapped_column(ForeignKey("experiment.id"))
    number: Mapped[int]
    state: Mapped[State] = mapped_column(default=State.QUEUED)
    owner: Mapped[str | None] = mapped_column(String(200))
    epoch: Mapped[int] = mapped_column(default=0)
    heartbeat_at: Mapped[datetime | None]
    attempts: Mapped[int] = mapped_column(default=0)
    losses: Mapped[int] = mapped_column(default=0)
    error: Mapped[str | None] = mapped_column(Text)
    steps: Mapped[int] = mapped_column(default=0)
    checkpoints: Mapped[int] = mapped_column(default=0, server_default="0")
    iterations_done: Mapped[int] = mapped_column(default=0)
    rollouts_done: Mapped[int] = mapped_column(BigInteger, default=0)
    rollouts_failed: Mapped[int] = mapped_column(BigInteger, default=0)
    rollouts_saved: Mapped[int] = mapped_column(BigInteger, default=0)
    seconds: Mapped[float] = mapped_column(default=0.0)
    provenance_id: Mapped[str | None] = mapped_column(String(32))
    started_at: Mapped[datetime | None]
    ended_at: Mapped[datetime | None]
