"""The tables.

    study ──< experiment ──< repetition ──< iteration ──< measurement
                                                     └──< simulator
    sensitivity, named after what it checks, which many experiments have in common

What is plotted or filtered is a column; vectors are JSON arrays, in which floats round-trip exactly. Neither a database
nor JSON has nan or infinity: a fitness of nan and a squared error of infinity are NULL.

The tallies in `repetition` (steps, rollouts, seconds) are kept in the transaction that adds the rows they count, so
that progress is a sum over repetitions and never reads results.
"""

from datetime import datetime
from typing import Any, ClassVar

from sqlalchemy import (
    JSON,
    BigInteger,
    Double,
    Enum,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    MetaData,
    String,
    Text,
    UniqueConstraint,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from schemas.lifecycle import State
from schemas.records import MeasurementKind
from services.store.clock import UtcDateTime, now

REVISION = "0002"
"""The migration that makes these tables; a database at any other revision is not ours to touch."""

SPEC_VERSION = 1
"""Of the specs that are stored now."""


class Base(DeclarativeBase):
    """The base of all tables: every constraint has a name, so that a migration can name it."""

    metadata = MetaData(
        naming_convention={
            "pk": "pk_%(table_name)s",
            "fk": "fk_%(table_name)s_%(column_0_N_name)s_%(referred_table_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
        }
    )
    type_annotation_map: ClassVar[dict[Any, Any]] = {
        datetime: UtcDateTime(),
        float: Double(),
        list[float]: JSON(none_as_null=True),
        list[dict[str, Any]]: JSON(none_as_null=True),
        dict[str, Any]: JSON(none_as_null=True),
        State: Enum(State, native_enum=False, create_constraint=True, length=16, name="state"),
        MeasurementKind: Enum(
            MeasurementKind,
            native_enum=False,
            create_constraint=True,
            length=16,
            name="kind",
            values_callable=lambda kinds: [each.value for each in kinds],
        ),
    }


class StudyRow(Base):
    """Experiments that belong together to be compared."""

    __tablename__ = "study"
    __table_args__ = (Index(None, "created_at", "id"),)

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(200))
    created_at: Mapped[datetime]


class ExperimentRow(Base):
    """One resolved spec.

    Attributes:
        position: within its study.
        iterations: of one repetition, number 0 included.
        rollouts: expected of one repetition.
    """

    __tablename__ = "experiment"
    __table_args__ = (Index(None, "created_at", "position", "id"),)

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
        losses: times that its worker was lost since a step was last recorded.
        steps: recorded so far; the position that the next step takes in the log.
        seconds: of work in the recorded steps.
    """

    __tablename__ = "repetition"
    __table_args__ = (UniqueConstraint("experiment_id", "number"), Index(None, "state", "heartbeat_at"))

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
    iterations_done: Mapped[int] = mapped_column(default=0)
    rollouts_done: Mapped[int] = mapped_column(BigInteger, default=0)
    rollouts_failed: Mapped[int] = mapped_column(BigInteger, default=0)
    rollouts_saved: Mapped[int] = mapped_column(BigInteger, default=0)
    seconds: Mapped[float] = mapped_column(default=0.0)
    started_at: Mapped[datetime | None]
    ended_at: Mapped[datetime | None]


class IterationRow(Base):
    """Select, measure, tune, transfer; what has not happened yet is NULL.

    The rollouts of a phase are NULL until it is recorded. Number 0, the untuned baseline, selects nothing.
    """

    __tablename__ = "iteration"

    repetition_id: Mapped[int] = mapped_column(ForeignKey("repetition.id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    selected_genome: Mapped[list[float] | None]
    selection_rollouts: Mapped[int | None] = mapped_column(BigInteger)
    selection_failures: Mapped[int | None] = mapped_column(BigInteger)
    selection_saved: Mapped[int | None] = mapped_column(BigInteger)
    tuning_rollouts: Mapped[int | None] = mapped_column(BigInteger)
    tuning_failures: Mapped[int | None] = mapped_column(BigInteger)
    tuning_saved: Mapped[int | None] = mapped_column(BigInteger)
    transferred_genome: Mapped[list[float] | None]
    simulated_fitness: Mapped[float | None]
    transfer_rollouts: Mapped[int | None] = mapped_column(BigInteger)
    transfer_failures: Mapped[int | None] = mapped_column(BigInteger)
    transfer_saved: Mapped[int | None] = mapped_column(BigInteger)
    recorded_fitness: Mapped[float | None]
    seconds: Mapped[float] = mapped_column(default=0.0)
    ended_at: Mapped[datetime | None]


class MeasurementRow(Base):
    """One real-world evaluation."""

    __tablename__ = "measurement"
    __table_args__ = (
        ForeignKeyConstraint(["repetition_id", "iteration"], ["iteration.repetition_id", "iteration.number"]),
    )

    repetition_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    iteration: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    kind: Mapped[MeasurementKind] = mapped_column(primary_key=True)
    genome: Mapped[list[float]]
    fitness: Mapped[float | None]
    measured_by: Mapped[str] = mapped_column(String(100))
    measured_at: Mapped[datetime] = mapped_column(default=now())


class SimulatorRow(Base):
    """One tuned simulator; rank 0 is the best of its iteration."""

    __tablename__ = "simulator"
    __table_args__ = (
        ForeignKeyConstraint(["repetition_id", "iteration"], ["iteration.repetition_id", "iteration.number"]),
    )

    repetition_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    iteration: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    rank: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    parameters: Mapped[list[float]]
    squared_error: Mapped[float | None]


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
