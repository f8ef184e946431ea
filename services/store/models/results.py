"""Results of repetitions."""

from datetime import datetime

from sqlalchemy import (
    BigInteger,
    ForeignKey,
    ForeignKeyConstraint,
    String,
)
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.schemas.records import MeasurementKind
from gaplab.services.store.clock import now
from gaplab.services.store.models.base import Base


class IterationRow(Base):
    """An iteration: select, measure, tune, transfer; columns of later steps are NULL.

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
    """One real-world evaluation. Readings are NULL if the robot has no sensors; one of them, if its sensor failed.

    Attributes:
        repeats: the values whose mean is the fitness; NULL if it is a single value.
        left_out: true for a probe that the spec does not ask for.
    """

    __tablename__ = "measurement"
    __table_args__ = (
        ForeignKeyConstraint(["repetition_id", "iteration"], ["iteration.repetition_id", "iteration.number"]),
    )

    repetition_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    iteration: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    kind: Mapped[MeasurementKind] = mapped_column(primary_key=True)
    genome: Mapped[list[float]]
    fitness: Mapped[float | None]
    readings: Mapped[list[float | None] | None]
    repeats: Mapped[list[float] | None]
    left_out: Mapped[bool] = mapped_column(server_default="0")
    measured_by: Mapped[str] = mapped_column(String(100))
    measured_at: Mapped[datetime] = mapped_column(default=now())


class SimulatorRow(Base):
    """One tuned simulator; rank 0 is the best of its iteration.

    Its 95 % intervals, from `lower` to `upper`, and its share of the posterior are NULL unless the tuner gives them.
    Its discrepancy from held-out samples is NULL unless it is the best, and there are some; its fit unless it is the
    best, and the noise is known: expected error, surprise, scale of intervals, then the errors of readings.
    """

    __tablename__ = "simulator"
    __table_args__ = (
        ForeignKeyConstraint(["repetition_id", "iteration"], ["iteration.repetition_id", "iteration.number"]),
    )

    repetition_id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    iteration: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    rank: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    parameters: Mapped[list[float]]
    squared_error: Mapped[float | None]
    lower: Mapped[list[float] | None]
    upper: Mapped[list[float] | None]
    weight: Mapped[float | None]
    held_out_error: Mapped[float | None]
    fit: Mapped[list[float | None] | None]
