"""Results: samples, simulators, recorded fitnesses and costs of iterations."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from sqlalchemy import ColumnElement, Select, case, func, select, tuple_
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import MeasurementKind, SampleRead, SimulatorRead
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.stored_specs import discrepancy_of
from gaplab.services.store.cursor import decode, encode
from gaplab.services.store.models import ExperimentRow, IterationRow, MeasurementRow, RepetitionRow, SimulatorRow
from gaplab.services.store.queries.repetition_rows import of_experiments
from gaplab.services.store.queries.tunings import measured, per_sample, samples_until

_TURN = case((MeasurementRow.kind == MeasurementKind.SAMPLE, 0), else_=1)
"""Within an iteration the sample comes before the probe."""


def _page(
    session: Session,
    query: Select[Any],
    key: tuple[Any, ...],
    wanted: Mapping[Any, Any],
    limit: int,
    cursor: str | None,
) -> Iterable[Any]:
    """Return up to `limit` rows after the cursor, in the order of the key; a wanted value of None permits all."""
    query = query.where(*(column == value for column, value in wanted.items() if value is not None))
    if cursor is not None:
        query = query.where(tuple_(*key) > decode(cursor, key))
    return session.execute(query.order_by(*key).limit(limit))


def page_of_samples(
    session: Session,
    experiment: str,
    *,
    repetition: int | None,
    kind: MeasurementKind | None,
    limit: int,
    cursor: str | None,
) -> tuple[SampleRead, ...]:
    """Return up to `limit` real-world evaluations of an experiment, by repetition in the order of the log.

    Raises:
        InvalidSpec: the cursor is invalid.
    """
    row = MeasurementRow
    columns = row.iteration, row.kind, row.genome, row.fitness, row.readings, row.measured_by, row.measured_at
    query = of_experiments(row, [experiment], RepetitionRow.number, *columns)
    key, wanted = (RepetitionRow.number, row.iteration, _TURN), {RepetitionRow.number: repetition, row.kind: kind}
    names = tuple(SampleRead.model_fields)
    return tuple(
        SampleRead(**dict(zip(names, each, strict=True))) for each in _page(session, query, key, wanted, limit, cursor)
    )


def page_of_simulators(
    session: Session,
    experiment: ExperimentRow,
    *,
    repetition: int | None,
    iteration: int | None,
    limit: int,
    cursor: str | None,
) -> tuple[SimulatorRead, ...]:
    """Return up to `limit` simulators of an experiment, by repetition, iteration and rank.

    Raises:
        InvalidSpec: the cursor is invalid.
    """
    row = SimulatorRow
    key = (RepetitionRow.number, row.iteration, row.rank)
    query = of_experiments(row, [experiment.id], *key, row)
    wanted = {RepetitionRow.number: repetition, row.iteration: iteration}
    names = [each["name"] for each in experiment.spec["tunables"]]
    tuned_on = measured(session, experiment).tuned_on
    discrepancy = discrepancy_of(experiment.spec)
    return tuple(
        _simulator(number, found, names, samples_until(tuned_on, number, found.iteration), discrepancy)
        for number, *_, found in _page(session, query, key, wanted, limit, cursor)
    )


def _simulator(
    repetition: int, row: SimulatorRow, names: Sequence[str], samples: int, discrepancy: Discrepancy
) -> SimulatorRead:
    pairs = None if row.lower is None or row.upper is None else zip(row.lower, row.upper, strict=True)
    return SimulatorRead(
        repetition=repetition,
        iteration=row.iteration,
        rank=row.rank,
        parameters=dict(zip(names, row.parameters, strict=True)),
        squared_error=row.squared_error,
        error=per_sample(row.squared_error, samples, discrepancy),
        intervals=None if pairs is None else dict(zip(names, pairs, strict=True)),
        weight=row.weight,
        held_out_error=row.held_out_error,
    )


def cursor_of(row: SampleRead | SimulatorRead) -> str:
    """Return the cursor of the page that begins after the row."""
    if isinstance(row, SimulatorRead):
        return encode(row.repetition, row.iteration, row.rank)
    return encode(row.repetition, row.iteration, 0 if row.kind is MeasurementKind.SAMPLE else 1)


def recorded(session: Session, experiments: Sequence[str]) -> Sequence[tuple[str, int, int, float | None]]:
    """Return experiment, repetition, iteration and recorded fitness of every iteration that has one."""
    row = IterationRow
    columns = RepetitionRow.experiment_id, RepetitionRow.number, row.number, row.recorded_fitness
    return session.execute(of_experiments(row, experiments, *columns).where(row.recorded_fitness.is_not(None))).all()


def best_recorded(session: Session, experiments: Sequence[str]) -> dict[str, list[float]]:
    """Return the best recorded fitness of each repetition so far, by experiment."""
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
    return found


def last_common(session: Session, experiments: Sequence[str]) -> dict[str, int]:
    """Return the last number of real-world evaluations that the repetitions of each experiment share.

    The COMPLETED repetitions count. Without any, those that have begun and may go on count; without any of those, all
    that have begun. An experiment without a point of its curve is missing.
    """
    counted = session.execute(last_common_of_all().where(RepetitionRow.experiment_id.in_(experiments)))
    return {experiment: done - 1 for experiment, done in counted if done is not None}


def last_common_of_all() -> Select[Any, Any]:
    """Return the query for the iterations that the repetitions of each experiment share, number 0 included."""
    row = RepetitionRow

    def least(*states: State) -> ColumnElement[int | None]:
        return func.min(case((row.state.in_(states), row.iterations_done)))

    begun = func.coalesce(least(State.COMPLETED), least(State.QUEUED, State.RUNNING), func.min(row.iterations_done))
    query = select(row.experiment_id, begun.label("done")).where(row.iterations_done > 0)
    return query.group_by(row.experiment_id)


def recorded_at(session: Session, counts: Mapping[str, int]) -> dict[str, list[float]]:
    """Return the recorded fitness of repetitions, by number, after one number of evaluations for each experiment."""
    if not counts:
        return {}
    row, found = IterationRow, dict[str, list[float]]()
    query = of_experiments(row, list(counts), RepetitionRow.experiment_id, row.recorded_fitness)
    query = query.where(row.number == case(dict(counts), value=RepetitionRow.experiment_id))
    query = query.where(row.recorded_fitness.is_not(None)).order_by(RepetitionRow.experiment_id, RepetitionRow.number)
    for experiment, fitness in session.execute(query):
        found.setdefault(experiment, []).append(fitness)
    return found


def iteration_costs(session: Session, experiments: Sequence[str]) -> Sequence[tuple[str, int, int, int, float, bool]]:
    """Return the cost of each iteration, in the order of the log.

    Returns:
        Experiment, repetition, iteration, rollouts, seconds, and whether the iteration has a recorded fitness.
    """
    row = IterationRow
    phases = (row.selection_rollouts, row.tuning_rollouts, row.transfer_rollouts)
    rollouts = sum((func.coalesce(each, 0) for each in phases[1:]), func.coalesce(phases[0], 0))
    key = RepetitionRow.experiment_id, RepetitionRow.number, row.number
    query = of_experiments(row, experiments, *key, rollouts, row.seconds, row.recorded_fitness.is_not(None))
    return session.execute(query.order_by(*key)).all()
