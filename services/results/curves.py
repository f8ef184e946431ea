"""Curves of stored experiments, and their costs: rollouts in simulation, or time, at each real-world evaluation."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from statistics import fmean
from typing import Literal

import numpy as np

from gaplab.schemas.curves import Curve, Fitness
from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.curves import best_of_searches, curve_points
from gaplab.services.core.errors import InvalidSpec, unknown_name
from gaplab.services.csv_tables import csv_text
from gaplab.services.figures.kinds.curves import CostAxis
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


Cost = Literal["rollouts", "time"]

Point = tuple[str, int]
"""Experiment and number of real-world evaluations."""

SCALES = ((1.0, ""), (1e3, "thousands"), (1e6, "millions"), (1e9, "thousand millions"))
UNITS_OF_TIME = ((1.0, "s"), (60.0, "min"), (3600.0, "h"), (86_400.0, "d"))

LEAST_IN_UNIT = 3.0
"""The greatest value in a unit must be at least this, or a smaller unit is used."""


def cost_axis(store: Store, curves: Sequence[Curve], cost: Cost, *, cost_s: float = 0.0) -> CostAxis:
    """Return the horizontal axis for curves that are drawn against the rollouts, or the time, that they took so far.

    Each real-world evaluation takes `cost_s` seconds. The level of a strategy without samples has no place on it.
    """
    with store.reading() as session:
        costs = results.iteration_costs(session, [curve.experiment for curve in curves if not curve.level])
    means = _mean_costs(costs)
    if cost == "rollouts":
        return _rollouts({point: rollouts for point, (rollouts, _) in means.items()})
    simulated = any(seconds for _, seconds in means.values())
    return _time({point: point[1] * cost_s + seconds for point, (_, seconds) in means.items()}, cost_s, simulated)


def _mean_costs(rows: Iterable[tuple[str, int, int, int, float, bool]]) -> dict[Point, tuple[float, float]]:
    """Return rollouts and seconds so far, as means over the repetitions with a recorded fitness at a point.

    The rows are those of `iteration_costs`, in the order of the log.
    """
    so_far: dict[tuple[str, int], tuple[int, float]] = defaultdict(lambda: (0, 0.0))
    found: dict[Point, list[tuple[int, float]]] = defaultdict(list)
    for experiment, repetition, iteration, rollouts, seconds, recorded in rows:
        before = so_far[experiment, repetition]
        so_far[experiment, repetition] = (before[0] + rollouts, before[1] + seconds)
        if recorded:
            found[experiment, iteration].append(so_far[experiment, repetition])
    return {
        point: (fmean(each[0] for each in costs), fmean(each[1] for each in costs)) for point, costs in found.items()
    }


def _rollouts(costs: Mapping[Point, float]) -> CostAxis:
    scale, word = _suited(costs, SCALES)
    return CostAxis(
        label=f"Rollouts in simulation ({word})" if word else "Rollouts in simulation",
        note="Rollouts: all so far, to select, tune and transfer; mean over repetitions.",
        at={point: value / scale for point, value in costs.items()},
    )


def _time(costs: Mapping[Point, float], cost_s: float, simulated: bool) -> CostAxis:
    scale, unit = _suited(costs, UNITS_OF_TIME)
    parts = [f"real-world evaluations at {cost_s:g}\N{NO-BREAK SPACE}s each"] if cost_s else []
    parts += ["simulation as measured, mean over repetitions"] if simulated else []
    note = f"Time: {' and '.join(parts) or 'none; evaluations cost none, and simulation was not measured'}."
    if parts and not simulated:
        note += " The time of simulation is not stored."
    return CostAxis(label=f"Time ({unit})", note=note, at={point: value / scale for point, value in costs.items()})


def _suited(costs: Mapping[Point, float], scales: Sequence[tuple[float, str]]) -> tuple[float, str]:
    """Return the largest scale on which the greatest cost is at least `LEAST_IN_UNIT`."""
    most = max(costs.values(), default=0.0)
    return next((each for each in reversed(scales) if most >= LEAST_IN_UNIT * each[0]), scales[0])
