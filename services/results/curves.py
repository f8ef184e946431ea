"""Curves of stored experiments."""

from collections.abc import Mapping, Sequence

import numpy as np

from gaplab.schemas.curves import Curve, Fitness
from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.curves import best_of_searches, curve_points
from gaplab.services.core.errors import InvalidSpec, unknown_name
from gaplab.services.csv_tables import csv_text
from gaplab.services.specs.resolution import is_direct
from gaplab.services.specs.robots import unit
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import experiments, progress, results
from gaplab.services.store.session import Session, Store

COLUMNS = ("experiment", "name", "strategy", "repetition", "evaluations", "fitness")


def curves(store: Store, ids: Sequence[str], fitness: Fitness = Fitness.RECORDED) -> tuple[Curve, ...]:
    """Return the curves of the experiments that the ids of studies and experiments mean, in their order.

    Raises:
        NotFound: there is nothing with one of the ids.
    """
    with store.reading() as session:
        return curves_of(session, experiments.meant(session, ids), fitness)


def curves_of(
    session: Session, rows: Sequence[ExperimentRow], fitness: Fitness = Fitness.RECORDED
) -> tuple[Curve, ...]:
    """Return the curves of experiments in the snapshot of a session."""
    values = values_of(session, rows, fitness)
    studies = experiments.study_names(session, rows)
    return tuple(_curve(row, values[row.id], fitness, studies[row.study_id]) for row in rows)


def curve(store: Store, experiment_id: str, fitness: Fitness = Fitness.RECORDED) -> Curve:
    """Return the curve of an experiment so far.

    Raises:
        NotFound: the experiment does not exist.
    """
    with store.reading() as session:
        return curves_of(session, [experiments.get_experiment(session, experiment_id)], fitness)[0]


def arranged(found: Sequence[Curve], labels: Mapping[str, str], order: Sequence[str]) -> list[Curve]:
    """Return curves with other names, and those in `order` first; experiments are meant by id, name or strategy.

    Raises:
        InvalidSpec: labels or order name none of the experiments.
    """
    names = {one.experiment: (one.experiment, one.name, one.strategy) for one in found}
    permitted = list(dict.fromkeys(name for each in names.values() for name in reversed(each)))
    given = [*(("labels", key) for key in labels), *(("order", key) for key in order)]
    if wrong := [unknown_name(at, "experiment", key, permitted) for at, key in given if key not in permitted]:
        raise InvalidSpec(wrong)

    def place(one: Curve) -> int:
        return min((order.index(name) for name in names[one.experiment] if name in order), default=len(order))

    called = {id: next((labels[name] for name in each if name in labels), None) for id, each in names.items()}
    ordered = sorted(found, key=place)
    return [one.model_copy(update={"name": called[one.experiment] or one.name}) for one in ordered]


def curves_csv(curves: Sequence[Curve]) -> str:
    """Return the values of curves as CSV: a line for each repetition at each number of real-world evaluations.

    A text that a spreadsheet would take for a formula begins with an apostrophe. Numbers are numbers, also negative.
    """
    rows = (
        (each.experiment, each.name, each.strategy, repetition, point.evaluations, value)
        for each in curves
        for point in each.points
        for repetition, value in enumerate(point.values)
        if value is not None
    )
    return csv_text(COLUMNS, rows)


def values_of(
    session: Session, rows: Sequence[ExperimentRow], fitness: Fitness = Fitness.RECORDED
) -> dict[str, FloatArray]:
    """Return the fitness of each experiment: `(repetitions, k)`, nan if missing, up to the last iteration done.

    A failed controller is never the best. Where one was not measured, there is no best from there on: others had more
    chances.
    """
    ids = [row.id for row in rows]
    recorded = fitness is Fitness.RECORDED
    found = (
        results.recorded(session, ids) if recorded else results.measured_fitness(session, ids, MeasurementKind.PROBE)
    )
    done = progress.most_done(session, ids)  # not those of the spec, which may come from an archive
    values = {row.id: np.full((row.spec["repetitions"], max(1, done[row.id])), np.nan) for row in rows}
    for experiment, repetition, iteration, value in found:
        values[experiment][repetition, iteration] = -np.inf if value is None else value
    if fitness is Fitness.EQUAL_CHANCES:
        values = {id_: np.maximum.accumulate(each, axis=1) for id_, each in values.items()}
    return {id_: np.where(np.isneginf(each), np.nan, each) for id_, each in values.items()}


def _curve(row: ExperimentRow, values: FloatArray, fitness: Fitness, study: str) -> Curve:
    spec = spec_of(row.spec)
    direct = is_direct(spec)
    return Curve.filled_from(
        row,
        experiment=row.id,
        study_name=study,
        unit=unit(spec),
        fitness=fitness,
        direct=direct,
        level=row.level,
        points=curve_points(values),
        best_of=best_of_searches(values[:, 0]) if direct and not row.recorded else (),
    )
