"""Results: samples, simulators, recorded fitnesses and costs of iterations."""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any

from sqlalchemy import ColumnElement, Select, bindparam, case, func, select, tuple_
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import PENDING, State
from gaplab.schemas.records import MeasurementKind, SampleRead, SimulatorRead
from gaplab.services.core.arrays import frozen
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.repeats import standard_error
from gaplab.services.core.stored_specs import discrepancy_of
from gaplab.services.store.cursor import decode, encode
from gaplab.services.store.models import ExperimentRow, IterationRow, MeasurementRow, RepetitionRow, SimulatorRow
from gaplab.services.store.queries.logs import fit_of
from gaplab.services.store.queries.repetition_rows import of_experiments
from gaplab.services.store.queries.tunings import intervals, measured, per_sample

_TURN = case((MeasurementRow.kind == MeasurementKind.SAMPLE, 0), else_=1)
"""Within an iteration the sample comes before the probe."""

_ASKED = RepetitionRow.experiment_id.in_(bindparam("experiments", expanding=True))
"""Condition of statements that are built once: building and hashing one takes longer than SQLite needs for it."""


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
    columns = row.iteration, row.kind, row.genome, row.fitness, row.readings, row.repeats
    query = of_experiments(row, [experiment], RepetitionRow.number, *columns, row.measured_by, row.measured_at)
    query = query.where(~row.left_out)
    key, wanted = (RepetitionRow.number, row.iteration, _TURN), {RepetitionRow.number: repetition, row.kind: kind}
    return tuple(_sample(found._mapping) for found in _page(session, query, key, wanted, limit, cursor))


def _sample(found: Mapping[str, Any]) -> SampleRead:
    values = dict(found)
    values["repetition"] = values.pop("number")
    values["standard_error"] = standard_error(frozen(values["repeats"] or ()))
    return SampleRead(**values)


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
    tuned = measured(session, experiment)
    discrepancy = discrepancy_of(experiment.spec)
    tunables = experiment.spec["tunables"]
    return tuple(
        _simulator(number, found, tunables, tuned.tuned_until(number, found.iteration), discrepancy)
        for number, *_, found in _page(session, query, key, wanted, limit, cursor)
    )


def _simulator(
    repetition: int, row: SimulatorRow, tunables: Sequence[Mapping[str, Any]], samples: int, discrepancy: Discrepancy
) -> SimulatorRead:
    names, fit = [each["name"] for each in tunables], fit_of(row.fit)
    pairs = intervals(row.parameters, row.lower, row.upper, fit, tunables)
    return SimulatorRead.filled_from(
        row,
        repetition=repetition,
        parameters=dict(zip(names, row.parameters, strict=True)),
        error=per_sample(row.squared_error, samples, discrepancy),
        intervals=None if pairs is None else dict(zip(names, map(tuple, pairs.tolist()), strict=True)),
        expected_error=None if fit is None else per_sample(fit.expected_error, samples, discrepancy),
        surprise=None if fit is None else fit.surprise,
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


def measured_fitness(
    session: Session, experiments: Sequence[str], kind: MeasurementKind
) -> Sequence[tuple[str, int, int, float | None]]:
    """Return experiment, repetition, iteration and fitness of every measurement of a kind; None if it failed."""
    row = MeasurementRow
    columns = RepetitionRow.experiment_id, RepetitionRow.number, row.iteration, row.fitness
    return session.execute(of_experiments(row, experiments, *columns).where(row.kind == kind, ~row.left_out)).all()


def best_recorded(session: Session, experiments: Sequence[str]) -> dict[str, list[float]]:
    """Return the best recorded fitness of each repetition so far, by experiment."""
    found: dict[str, list[float]] = {}
    for experiment, best in session.execute(_best_recorded(), {"experiments": list(experiments)}):
        if best is not None:
            found.setdefault(experiment, []).append(best)
    return found


@cache
def _best_recorded() -> Select[Any]:
    row = IterationRow
    of_one = select(func.max(row.recorded_fitness)).where(row.repetition_id == RepetitionRow.id).scalar_subquery()
    return select(RepetitionRow.experiment_id, of_one).where(_ASKED)


def last_common(session: Session, experiments: Sequence[str]) -> dict[str, int]:
    """Return the last number of real-world evaluations that the repetitions of each experiment share.

    The repetitions with all their iterations count. Without any, the COMPLETED ones count, which were stopped early;
    then those that have begun and may go on; then all that have begun. An experiment without a point of its curve is
    missing.
    """
    counted = session.execute(_last_common(), {"experiments": list(experiments)})
    return {experiment: done - 1 for experiment, done in counted if done is not None}


@cache
def _last_common() -> Select[Any]:
    return last_common_of_all().where(_ASKED)


@cache
def last_common_of_all() -> Select[Any, Any]:
    """Return the query for the iterations that the repetitions of each experiment share, number 0 included."""
    row = RepetitionRow

    def least(where: ColumnElement[bool]) -> ColumnElement[int | None]:
        return func.min(case((where, row.iterations_done)))

    completed = row.state == State.COMPLETED
    whole = least(completed & (row.iterations_done >= ExperimentRow.iterations))
    begun = func.coalesce(whole, least(completed), least(row.state.in_(PENDING)), func.min(row.iterations_done))
    query = select(row.experiment_id, begun.label("done")).where(row.iterations_done > 0)
    return query.join(ExperimentRow, ExperimentRow.id == row.experiment_id).group_by(row.experiment_id)


def recorded_at(session: Session, counts: Mapping[str, int]) -> dict[str, list[float]]:
    """Return the recorded fitness of repetitions, by number, after one number of evaluations for each experiment."""
    if not counts:
        return {}
    found = dict[str, list[float]]()
    asked = {"experiments": list(counts), "numbers": list(set(counts.values()))}
    for experiment, number, fitness in session.execute(_recorded_at(), asked):
        if number == counts[experiment]:
            found.setdefault(experiment, []).append(fitness)
    return found


@cache
def _recorded_at() -> Select[Any, Any, Any]:
    row = IterationRow
    query = select(RepetitionRow.experiment_id, row.number, row.recorded_fitness)
    query = query.join(RepetitionRow, RepetitionRow.id == row.repetition_id).where(_ASKED)
    query = query.where(row.number.in_(bindparam("numbers", expanding=True)), row.recorded_fitness.is_not(None))
    return query.order_by(RepetitionRow.experiment_id, RepetitionRow.number)


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


def points_of_all() -> tuple[Select[Any], ColumnElement[Any]]:
    """Return the ids of experiments with a fitness after the last common number, grouped, and that of a repetition."""
    row, shared = IterationRow, last_common_of_all().subquery()
    query = select(RepetitionRow.experiment_id).join(shared, shared.c.experiment_id == RepetitionRow.experiment_id)
    query = query.join(row, (row.repetition_id == RepetitionRow.id) & (row.number == shared.c.done - 1))
    return query.where(row.recorded_fitness.is_not(None)).group_by(
        RepetitionRow.experiment_id
    ), row.recorded_fitness.expression


def best_of_all() -> tuple[Select[Any], ColumnElement[Any]]:
    """Return the ids of experiments with a recorded fitness, grouped, and the best of a repetition in these groups."""
    best = (
        select(RepetitionRow.experiment_id, func.max(IterationRow.recorded_fitness).label("best"))
        .join(IterationRow, IterationRow.repetition_id == RepetitionRow.id)
        .where(IterationRow.recorded_fitness.is_not(None))
        .group_by(RepetitionRow.id, RepetitionRow.experiment_id)
        .subquery()
    )
    return select(best.c.experiment_id).group_by(best.c.experiment_id), best.c.best
