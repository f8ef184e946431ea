"""Results: samples, simulators, recorded fitnesses and costs of iterations."""

from collections.abc import Mapping, Sequence
from functools import cache
from itertools import islice
from typing import Any

from sqlalchemy import ColumnElement, Select, bindparam, case, func, select, tuple_
from sqlalchemy.orm import Session, aliased

from gaplab.schemas.lifecycle import PENDING, State
from gaplab.schemas.records import MeasurementKind, Page, SampleRead, SimulatorRead
from gaplab.services.core.arrays import frozen
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.repeats import standard_error
from gaplab.services.specs.stored_specs import discrepancy_of
from gaplab.services.store.cursor import decode, encode, key_of, next_cursor
from gaplab.services.store.models import LOG, ExperimentRow, RepetitionRow, StepKind, StepRow
from gaplab.services.store.queries.experiments import (
    MEASURED,
    get_experiment,
    in_log,
    of_experiments,
    same_log,
    steps_of,
)
from gaplab.services.store.queries.logs import simulator_of
from gaplab.services.store.queries.tunings import intervals, measured, per_sample

_ASKED = RepetitionRow.experiment_id.in_(bindparam("experiments", expanding=True))
"""Condition of statements that are built once: building and hashing one takes longer than SQLite needs for it."""


def page_of_samples(
    session: Session,
    experiment_id: str,
    *,
    repetition: int | None = None,
    kind: MeasurementKind | None = None,
    limit: int = 1000,
    cursor: str | None = None,
) -> Page[SampleRead]:
    """Return a page of real-world evaluations of an experiment, by repetition and in the order of the log.

    Raises:
        NotFound: the experiment does not exist.
        InvalidSpec: the cursor is invalid, or of another list.
    """
    get_experiment(session, experiment_id)
    row, run, transferred = StepRow, RepetitionRow, aliased(StepRow)
    key, turn = (run.number, row.iteration), case((row.kind == StepKind.MEASURED, 0), else_=1)
    columns = row.kind, row.iteration, row.fitness, row.measured_by, row.at, row.body
    query = of_experiments(row, [experiment_id], run.number, transferred.body, *columns).where(
        row.branch == LOG,
        row.measured_by.is_not(None),
        row.kind.in_(MEASURED.values() if kind is None else [MEASURED[kind]]),
    )
    evolved = same_log(row, transferred, StepKind.TRANSFERRED) & (transferred.iteration == row.iteration)
    query = query.outerjoin(transferred, evolved)
    if repetition is not None:
        query = query.where(run.number == repetition)
    if cursor is not None:
        query = query.where(tuple_(*key, turn) > decode(cursor, (*key, turn)))
    found = session.execute(query.order_by(*key, turn).limit(limit + 1))
    rows = tuple(_sample(number, evolved, step) for number, evolved, *step in found)
    return Page(items=rows[:limit], next=next_cursor(rows, limit, _cursor_of))


def _sample(repetition: int, evolved: Mapping[str, Any] | None, step: Sequence[Any]) -> SampleRead:
    kind, iteration, fitness, measured_by, at, body = step
    repeats, sampled = body.get("repeats"), kind is StepKind.MEASURED
    return SampleRead(
        repetition=repetition,
        iteration=iteration,
        kind=MeasurementKind.SAMPLE if sampled else MeasurementKind.PROBE,
        genome=(body if sampled else evolved or {})["genome"],
        fitness=fitness,
        readings=body.get("readings"),
        repeats=repeats,
        standard_error=standard_error(frozen(repeats or ())),
        measured_by=measured_by or "",
        measured_at=at,
    )


def page_of_simulators(
    session: Session,
    experiment_id: str,
    *,
    repetition: int | None = None,
    iteration: int | None = None,
    limit: int = 1000,
    cursor: str | None = None,
) -> Page[SimulatorRead]:
    """Return a page of tuned simulators of an experiment, by repetition, iteration and rank.

    Raises:
        NotFound: the experiment does not exist.
        InvalidSpec: the cursor is invalid, or of another list.
    """
    experiment = get_experiment(session, experiment_id)
    row, key = StepRow, (RepetitionRow.number, StepRow.iteration)
    query = steps_of([experiment.id], StepKind.TUNED, *key, row.body)
    for column, wanted in zip(key, (repetition, iteration), strict=True):
        query = query if wanted is None else query.where(column == wanted)
    last = (0, 0, -1) if cursor is None else key_of(cursor, (*key, row.place))
    query = query.where(tuple_(*key) >= last[:2]).order_by(*key)
    tuned, discrepancy = measured(session, experiment), discrepancy_of(experiment.spec)
    tunables = experiment.spec["tunables"]
    with session.execute(query, execution_options={"yield_per": 10}) as steps:
        members = (
            (number, at, rank, packed)
            for number, at, body in steps
            for rank, packed in enumerate(body["simulators"])
            if (number, at, rank) > last
        )
        rows = tuple(
            _simulator((number, at, rank), packed, tunables, tuned.tuned_until(number, at), discrepancy)
            for number, at, rank, packed in islice(members, limit + 1)
        )
    return Page(items=rows[:limit], next=next_cursor(rows, limit, _cursor_of))


def _simulator(
    place: tuple[int, int, int],
    packed: Mapping[str, Any],
    tunables: Sequence[Mapping[str, Any]],
    samples: int,
    discrepancy: Discrepancy,
) -> SimulatorRead:
    names, simulator = [each["name"] for each in tunables], simulator_of(packed)
    pairs, fit = intervals(simulator, tunables), simulator.fit
    return SimulatorRead(
        **dict(zip(("repetition", "iteration", "rank"), place, strict=True)),
        parameters=dict(zip(names, packed["parameters"], strict=True)),
        squared_error=packed["squared_error"],
        error=per_sample(simulator.squared_error, samples, discrepancy),
        weight=simulator.weight,
        held_out_error=simulator.held_out_error,
        intervals=None if pairs is None else dict(zip(names, map(tuple, pairs.tolist()), strict=True)),
        expected_error=None if fit is None else per_sample(fit.expected_error, samples, discrepancy),
        surprise=None if fit is None else fit.surprise,
    )


def _cursor_of(row: SampleRead | SimulatorRead) -> str:
    """Return the cursor of the page that begins after the row."""
    if isinstance(row, SimulatorRead):
        return encode(row.repetition, row.iteration, row.rank)
    return encode(row.repetition, row.iteration, 0 if row.kind is MeasurementKind.SAMPLE else 1)


def recorded(session: Session, experiments: Sequence[str]) -> Sequence[tuple[str, int, int, float | None]]:
    """Return experiment, repetition, iteration and recorded fitness of every iteration that has one."""
    row = StepRow
    columns = RepetitionRow.experiment_id, RepetitionRow.number, row.iteration, row.recorded
    query = steps_of(experiments, StepKind.PROBED, *columns).where(row.recorded.is_not(None))
    return session.execute(query.order_by(*columns[:3])).all()


def measured_fitness(
    session: Session, experiments: Sequence[str], kind: MeasurementKind
) -> Sequence[tuple[str, int, int, float | None]]:
    """Return experiment, repetition, iteration and fitness of every measurement of a kind; None if it failed."""
    row = StepRow
    columns = RepetitionRow.experiment_id, RepetitionRow.number, row.iteration, row.fitness
    query = steps_of(experiments, MEASURED[kind], *columns).where(row.measured_by.is_not(None))
    return session.execute(query.order_by(*columns[:3])).all()


def best_recorded(session: Session, experiments: Sequence[str]) -> dict[str, list[float]]:
    """Return the best recorded fitness of each repetition so far, by experiment."""
    found: dict[str, list[float]] = {}
    for experiment, best in session.execute(_best_recorded(), {"experiments": list(experiments)}):
        if best is not None:
            found.setdefault(experiment, []).append(best)
    return found


_PROBES = in_log(StepRow, StepKind.PROBED)


@cache
def _best_recorded() -> Select[Any]:
    row = StepRow
    of_one = select(func.max(row.recorded)).where(row.repetition_id == RepetitionRow.id, _PROBES).scalar_subquery()
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
    row = StepRow
    query = select(RepetitionRow.experiment_id, row.iteration, row.recorded)
    query = query.join(RepetitionRow, RepetitionRow.id == row.repetition_id).where(_ASKED, _PROBES)
    query = query.where(row.iteration.in_(bindparam("numbers", expanding=True)), row.recorded.is_not(None))
    return query.order_by(RepetitionRow.experiment_id, RepetitionRow.number)


def iteration_costs(session: Session, experiments: Sequence[str]) -> Sequence[tuple[str, int, int, int, float, bool]]:
    """Return the cost of each iteration, in the order of the log.

    Returns:
        Experiment, repetition, iteration, rollouts, seconds of simulation, which those of reality are not, and whether
        the iteration has a recorded fitness.
    """
    row = StepRow
    key = RepetitionRow.experiment_id, RepetitionRow.number, row.iteration
    seconds = func.sum(case((row.kind.in_([StepKind.MEASURED, StepKind.PROBED]), 0.0), else_=row.seconds))
    sums = func.sum(row.rollouts), seconds, func.count(row.recorded) > 0
    query = of_experiments(row, experiments, *key, *sums).where(row.branch == LOG)
    return session.execute(query.group_by(*key).order_by(*key)).all()


def points_of_all() -> tuple[Select[Any], ColumnElement[Any]]:
    """Return the ids of experiments with a fitness after the last common number, grouped, and that of a repetition."""
    row, shared = StepRow, last_common_of_all().subquery()
    query = select(RepetitionRow.experiment_id).join(shared, shared.c.experiment_id == RepetitionRow.experiment_id)
    query = query.join(row, (row.repetition_id == RepetitionRow.id) & (row.iteration == shared.c.done - 1))
    query = query.where(_PROBES, row.recorded.is_not(None)).group_by(RepetitionRow.experiment_id)
    return query, row.recorded.expression


def best_of_all() -> tuple[Select[Any], ColumnElement[Any]]:
    """Return the ids of experiments with a recorded fitness, grouped, and the best of a repetition in these groups."""
    best = (
        select(RepetitionRow.experiment_id, func.max(StepRow.recorded).label("best"))
        .join(StepRow, StepRow.repetition_id == RepetitionRow.id)
        .where(_PROBES, StepRow.recorded.is_not(None))
        .group_by(RepetitionRow.id, RepetitionRow.experiment_id)
        .subquery()
    )
    return select(best.c.experiment_id).group_by(best.c.experiment_id), best.c.best
