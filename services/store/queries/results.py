"""Samples, simulators and recorded fitnesses, as they are shown."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import fsum

from sqlalchemy import case, func, select, tuple_
from sqlalchemy.orm import Session

from gaplab.schemas.records import MeasurementKind, SampleRead, SimulatorRead
from gaplab.services.store.cursor import decode, encode
from gaplab.services.store.models import ExperimentRow, IterationRow, MeasurementRow, RepetitionRow, SimulatorRow

_TURN = case((MeasurementRow.kind == MeasurementKind.SAMPLE, 0), else_=1)
"""Within an iteration the sample comes before the probe."""


def page_of_samples(
    session: Session,
    experiment: str,
    *,
    repetition: int | None,
    kind: MeasurementKind | None,
    limit: int,
    cursor: str | None,
) -> tuple[SampleRead, ...]:
    """Up to `limit` real-world evaluations of an experiment, by repetition and in the order of the log.

    Raises:
        InvalidSpec: a cursor that is none.
    """
    row = MeasurementRow
    key = (RepetitionRow.number, row.iteration, _TURN)
    query = (
        select(RepetitionRow.number, row.iteration, row.kind, row.genome, row.fitness, row.measured_by, row.measured_at)
        .join(RepetitionRow, RepetitionRow.id == row.repetition_id)
        .where(RepetitionRow.experiment_id == experiment)
        .order_by(*key)
        .limit(limit)
    )
    wanted = {RepetitionRow.number: repetition, row.kind: kind}
    query = query.where(*(column == value for column, value in wanted.items() if value is not None))
    if cursor is not None:
        query = query.where(tuple_(*key) > decode(cursor, key))
    names = tuple(SampleRead.model_fields)
    return tuple(SampleRead(**dict(zip(names, each, strict=True))) for each in session.execute(query))


def page_of_simulators(
    session: Session,
    experiment: ExperimentRow,
    *,
    repetition: int | None,
    iteration: int | None,
    limit: int,
    cursor: str | None,
) -> tuple[SimulatorRead, ...]:
    """Up to `limit` tuned simulators of an experiment, by repetition, iteration and rank.

    Raises:
        InvalidSpec: a cursor that is none.
    """
    row = SimulatorRow
    key = (RepetitionRow.number, row.iteration, row.rank)
    query = (
        select(*key, row.parameters, row.squared_error)
        .join(RepetitionRow, RepetitionRow.id == row.repetition_id)
        .where(RepetitionRow.experiment_id == experiment.id)
        .order_by(*key)
        .limit(limit)
    )
    wanted = {RepetitionRow.number: repetition, row.iteration: iteration}
    query = query.where(*(column == value for column, value in wanted.items() if value is not None))
    if cursor is not None:
        query = query.where(tuple_(*key) > decode(cursor, key))
    names = [each["name"] for each in experiment.spec["tunables"]]
    return tuple(
        SimulatorRead(
            repetition=number,
            iteration=each,
            rank=rank,
            parameters=dict(zip(names, parameters, strict=True)),
            squared_error=error,
        )
        for number, each, rank, parameters, error in session.execute(query)
    )


def cursor_of(row: SampleRead | SimulatorRead) -> str:
    """The cursor of the page that follows the row."""
    if isinstance(row, SimulatorRead):
        return encode(row.repetition, row.iteration, row.rank)
    return encode(row.repetition, row.iteration, 0 if row.kind is MeasurementKind.SAMPLE else 1)


def recorded(session: Session, experiments: Sequence[str]) -> Sequence[tuple[str, int, int, float | None]]:
    """Experiment, repetition, iteration and recorded fitness, for every iteration that has one."""
    row = IterationRow
    query = (
        select(RepetitionRow.experiment_id, RepetitionRow.number, row.number, row.recorded_fitness)
        .join(RepetitionRow, RepetitionRow.id == row.repetition_id)
        .where(RepetitionRow.experiment_id.in_(experiments), row.recorded_fitness.is_not(None))
    )
    return session.execute(query).all()


def best_recorded(session: Session, experiments: Sequence[str]) -> dict[str, float]:
    """Of each experiment, the best recorded fitness of a repetition so far, on average over those that have one."""
    of_one = (
        select(func.max(IterationRow.recorded_fitness))
        .where(IterationRow.repetition_id == RepetitionRow.id)
        .scalar_subquery()
    )
    query = select(RepetitionRow.experiment_id, of_one).where(RepetitionRow.experiment_id.in_(experiments))
    found: dict[str, list[float]] = {}
    for experiment, best in session.execute(query):
        if best is not None:
            found.setdefault(experiment, []).append(best)
    return {experiment: _mean(each) for experiment, each in found.items()}


def _mean(values: Sequence[float]) -> float:
    """The same in whatever order they come, and though their sum may be no number any more."""
    try:
        return fsum(values) / len(values)
    except OverflowError:
        return fsum(each / len(values) for each in values)


@dataclass(frozen=True)
class Best:
    """The best simulator of one iteration, and the controller that was evolved in it.

    Attributes:
        squared_error: None where its physics failed on a sample.
        simulated: the controller's fitness in it; None if there is none.
        real: the controller's fitness in reality; None if there is none.
    """

    repetition: int
    iteration: int
    parameters: list[float]
    squared_error: float | None
    simulated: float | None
    real: float | None


def best_simulators(session: Session, experiment: str) -> tuple[Best, ...]:
    """The best simulator of every iteration of every repetition that has one."""
    row, found, probe = IterationRow, SimulatorRow, MeasurementRow
    query = (
        select(
            RepetitionRow.number,
            row.number,
            found.parameters,
            found.squared_error,
            row.simulated_fitness,
            probe.fitness,
        )
        .join(RepetitionRow, RepetitionRow.id == row.repetition_id)
        .join(found, (found.repetition_id == row.repetition_id) & (found.iteration == row.number) & (found.rank == 0))
        .outerjoin(
            probe,
            (probe.repetition_id == row.repetition_id)
            & (probe.iteration == row.number)
            & (probe.kind == MeasurementKind.PROBE),
        )
        .where(RepetitionRow.experiment_id == experiment)
        .order_by(RepetitionRow.number, row.number)
    )
    return tuple(Best(*each) for each in session.execute(query))


def measured(session: Session, experiment: str) -> dict[int, list[int]]:
    """By repetition, the iterations whose sample has a fitness: those that simulators are tuned on."""
    row = MeasurementRow
    query = (
        select(RepetitionRow.number, row.iteration)
        .join(RepetitionRow, RepetitionRow.id == row.repetition_id)
        .where(RepetitionRow.experiment_id == experiment, row.kind == MeasurementKind.SAMPLE, row.fitness.is_not(None))
    )
    gathered: dict[int, list[int]] = {}
    for repetition, iteration in session.execute(query):
        gathered.setdefault(repetition, []).append(iteration)
    return gathered


def efforts(session: Session, experiments: Sequence[str]) -> Sequence[tuple[str, int, int, int, float, bool]]:
    """What each iteration took, in the order of the log.

    Experiment, repetition, iteration, rollouts, seconds, and whether it has a recorded fitness.
    """
    row = IterationRow
    phases = (row.selection_rollouts, row.tuning_rollouts, row.transfer_rollouts)
    rollouts = sum((func.coalesce(each, 0) for each in phases[1:]), func.coalesce(phases[0], 0))
    query = (
        select(
            RepetitionRow.experiment_id,
            RepetitionRow.number,
            row.number,
            rollouts,
            row.seconds,
            row.recorded_fitness.is_not(None),
        )
        .join(RepetitionRow, RepetitionRow.id == row.repetition_id)
        .where(RepetitionRow.experiment_id.in_(experiments))
        .order_by(RepetitionRow.experiment_id, RepetitionRow.number, row.number)
    )
    return session.execute(query).all()
