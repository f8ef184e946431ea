"""Studies, experiments and repetitions with their leases and attempts, sensitivity checks, and what was deleted."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, ForeignKey, Index, String, Text, UniqueConstraint
from sqlalchemy.ext.hybrid import hybrid_property
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.schemas.lifecycle import Ending, State
from gaplab.schemas.resolved import SPEC_VERSION
from gaplab.services.core.strategies import strategies
from gaplab.services.store.clock import now
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

    Its columns are those of `gaplab.services.store.lease.Checkpoint`.
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


class StudyRow(Base):
    """Experiments that belong together to be compared; one alone has the id of its study.

    Attributes:
        notes: Markdown by people.
        tags: tags with a space before and after each, as `gaplab.services.store.texts` packs them; NULL for none.
        edits: number of changes of its name, notes or tags, and of names of its experiments.
        archived_at: time since which lists leave it out; NULL if they do not.
        webhook: address that is told of its end; NULL for none.
        submitted: its spec, as `gaplab.services.specs.submitted` keeps it; NULL if it is not known.
    """

    __tablename__ = "study"
    __table_args__ = (Index(None, "created_at", "id"), Index(None, "name", "id"))

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(200))
    notes: Mapped[str | None] = mapped_column(Text)
    tags: Mapped[str | None] = mapped_column(Text)
    edits: Mapped[int] = mapped_column(default=0, server_default="0")
    archived_at: Mapped[datetime | None]
    webhook: Mapped[str | None] = mapped_column(Text)
    submitted: Mapped[dict[str, Any] | None]
    created_at: Mapped[datetime]


class ExperimentRow(Base):
    """One resolved spec.

    Attributes:
        position: position within its study.
        spec: resolved spec, which determines the results.
        iterations: iterations of one repetition, number 0 included.
        rollouts: expected rollouts of one repetition.
        precedence: negated priority: the smallest has its turn first, so that one index has the order of turns.
        max_parallel: largest number of repetitions that run at once; NULL for no limit.
        running: number of claimed repetitions.
        turn_at: when one of its repetitions was last claimed; when it was stored, before the first.
        claimable: whether one more may be claimed now. `services/experiments/states.py` keeps it and `running`.
        computed_with: engines, machine, version of the spec and external plug-ins that computed its first steps.
        refused_by: the same of a supervisor that skipped the experiment because they differ.
        paused_because: reason why a supervisor paused it; NULL if a person did, or has requested something since.
        hardware: name of the hardware that is its reality; NULL if reality is only computed.
        sensitivity_id: id of its sensitivity check.
        token_id: id of the token that submitted it; NULL without a token.
    """

    __tablename__ = "experiment"
    __table_args__ = (
        Index(None, "created_at", "position", "id"),
        Index("ix_experiment_turn", "claimable", "precedence", "running", "turn_at", "position", "id"),
        Index(None, "state", "id"),
        Index(None, "study_id", "state"),
    )

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    study_id: Mapped[str] = mapped_column(ForeignKey("study.id"))
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
    turn_at: Mapped[datetime] = mapped_column(default=now())
    claimable: Mapped[bool] = mapped_column(default=True)
    computed_with: Mapped[str | None] = mapped_column(Text)
    refused_by: Mapped[str | None] = mapped_column(Text)
    paused_because: Mapped[str | None] = mapped_column(Reason)
    hardware: Mapped[str | None] = mapped_column(String(32), index=True)
    sensitivity_id: Mapped[str | None] = mapped_column(String(32), index=True)
    token_id: Mapped[str | None] = mapped_column(String(32))
    created_at: Mapped[datetime]
    started_at: Mapped[datetime | None]
    ended_at: Mapped[datetime | None]

    @property
    def tunes(self) -> bool:
        """Whether its strategy tunes, and has samples for it: it takes some, has some from before, or recordings."""
        strategy = strategies.get(self.strategy)
        return (not self.level or self.recorded) and (strategy is None or strategy.tunes)

    @property
    def level(self) -> bool:
        """Whether it has no samples of its own, so that its curve is a horizontal line."""
        return self.iterations <= 1 and self.known == 0

    @property
    def recorded(self) -> bool:
        """Whether its reality is recorded."""
        return bool(self.spec["reality"]["kind"] == "recorded")

    @property
    def known(self) -> int:
        """Number of samples from before the experiment; 0 if its strategy takes no samples."""
        strategy = strategies.get(self.strategy)
        return len(self.spec["reality"]["samples"]) if strategy is None or strategy.takes_samples else 0


class RepetitionRow(LeasedRow):
    """One run of the algorithm, with its lease and its tallies.

    SQLite never uses the id of a deleted repetition again: a worker that has not heard of its end may still send steps.

    Attributes:
        losses: number of workers lost since a step or a checkpoint was last recorded.
        steps: place of the next step in the log; so many are recorded, unless a person told samples in between.
        checkpoints: number of stored parts of the next step.
        seconds: seconds of work in the recorded steps.
        provenance_id: provenance of its latest claim.
        measuring_at: time since which it waits for reality's answer; NULL if it does not wait.
        hidden_error: the error with the message of reality's code, to be shown when hidden parameters may be.
        hardware: name of the hardware that it holds; unique, so hardware has one holder at a time.
    """

    __tablename__ = "repetition"
    __table_args__ = (
        UniqueConstraint("experiment_id", "number"),
        UniqueConstraint("hardware"),
        Index(None, "state", "heartbeat_at"),
        Index(None, "experiment_id", "state", "number"),
        {"sqlite_autoincrement": True},
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    experiment_id: Mapped[str] = mapped_column(ForeignKey("experiment.id"))
    number: Mapped[int]
    steps: Mapped[int] = mapped_column(default=0)
    checkpoints: Mapped[int] = mapped_column(default=0, server_default="0")
    rollouts_done: Mapped[int] = mapped_column(BigInteger, default=0)
    rollouts_failed: Mapped[int] = mapped_column(BigInteger, default=0)
    rollouts_saved: Mapped[int] = mapped_column(BigInteger, default=0)
    seconds: Mapped[float] = mapped_column(default=0.0)
    provenance_id: Mapped[str | None] = mapped_column(String(32))
    measuring_at: Mapped[datetime | None]
    hidden_error: Mapped[str | None] = mapped_column(Reason)
    hardware: Mapped[str | None] = mapped_column(String(32))

    @hybrid_property
    def iterations_done(self) -> int:
        """Number of ended iterations: the first has three steps, each later one five."""
        return (self.steps + 2) // 5


class DeletionRow(Base):
    """A deleted study or experiment; its events still refer to it.

    Attributes:
        id: its id, which nothing else has unless its archive is imported again; then this row is removed.
        study_id: study of a deleted experiment; NULL for a study that had several.
        token_id: id of the token that deleted it; NULL without a token.
    """

    __tablename__ = "deletion"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    study_id: Mapped[str | None] = mapped_column(String(32))
    name: Mapped[str] = mapped_column(String(200))
    token_id: Mapped[str | None] = mapped_column(String(32))
    deleted_at: Mapped[datetime]
