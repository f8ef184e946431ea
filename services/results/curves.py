"""Curves and comparisons of stored experiments, computed by the core."""

import csv
import io
from collections.abc import Sequence

import numpy as np

from gaplab.schemas.curves import Comparison, Curve
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.curves import curve_points
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.core.statistics import compare_all
from gaplab.services.results.texts import cell
from gaplab.services.specs.resolution import is_direct, spec_of, unit
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import experiments, results
from gaplab.services.store.session import Session, Store

COLUMNS = ("experiment", "name", "strategy", "repetition", "evaluations", "fitness")


def curve(store: Store, experiment_id: str) -> Curve:
    """Return the curve of an experiment so far.

    Raises:
        NotFound: the experiment does not exist.
    """
    return curves(store, [experiment_id])[0]


def curves(store: Store, experiment_ids: Sequence[str]) -> tuple[Curve, ...]:
    """Return the curves of experiments, in their order.

    Raises:
        NotFound: an experiment does not exist.
    """
    with store.reading() as session:
        return curves_of(session, experiment_ids)


def curves_of(session: Session, experiment_ids: Sequence[str]) -> tuple[Curve, ...]:
    """Return the curves of experiments, as `curves` does, in the snapshot of a session.

    Raises:
        NotFound: an experiment does not exist.
    """
    rows, values = _recorded(session, experiment_ids)
    return tuple(_curve(row, values[row.id]) for row in rows)


def study_curves(store: Store, study_id: str) -> tuple[Curve, ...]:
    """Return the curves of a study's experiments, in its order.

    Raises:
        NotFound: the study does not exist.
    """
    with store.reading() as session:
        experiments.get_study(session, study_id)
        return curves_of(session, [row.id for row in experiments.experiments_of(session, [study_id])])


def compare(
    store: Store,
    experiment_ids: Sequence[str],
    *,
    from_evaluations: int | None = None,
    to_evaluations: int | None = None,
) -> tuple[Comparison, ...]:
    """Compare every pair of experiments on their recorded fitness, pooled over a range of real-world evaluations.

    The only value of an experiment without samples is in every range.

    Args:
        store: database with the experiments.
        experiment_ids: two or more, each once.
        from_evaluations: the first number of evaluations; by default 1.
        to_evaluations: the last number of evaluations; by default the last that an experiment has.

    Raises:
        NotFound: an experiment does not exist.
        InvalidSpec: fewer than two experiments, an experiment twice, or a range that is empty or negative.
    """
    if len(set(experiment_ids)) < max(2, len(experiment_ids)):
        message = f"a comparison needs two or more experiments, each once, not {len(experiment_ids)}"
        raise InvalidSpec([Violation("experiment", list(experiment_ids), message)])
    with store.reading() as session:
        rows, values = _recorded(session, experiment_ids)
    last = max(1, *(row.iterations - 1 for row in rows))
    first = 1 if from_evaluations is None else from_evaluations
    final = last if to_evaluations is None else to_evaluations
    if not 0 <= first <= final:
        message = f"the range of real-world evaluations must ascend from 0 or more, not from {first} to {final}"
        raise InvalidSpec([Violation("from_evaluations", first, message, f"0 to {final}")])
    levels = frozenset(row.id for row in rows if row.iterations == 1)
    names = {row.id: row.name for row in rows}
    return tuple(
        pair.model_copy(update={"first_name": names[pair.first], "second_name": names[pair.second]})
        for pair in compare_all(values, levels, first, final)
    )


def unit_of(store: Store, experiment_id: str) -> str:
    """Return the unit of fitness of an experiment; "" if it has none.

    Raises:
        NotFound: the experiment does not exist.
    """
    with store.reading() as session:
        return unit(spec_of(experiments.get_experiment(session, experiment_id).spec))


def curves_csv(curves: Sequence[Curve]) -> str:
    """Return the values of curves as CSV: a line for each repetition at each number of real-world evaluations.

    A text that a spreadsheet would take for a formula begins with an apostrophe. Numbers are numbers, also negative.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(
        (each.experiment, cell(each.name), cell(each.strategy), repetition, point.evaluations, value)
        for each in curves
        for point in each.points
        for repetition, value in enumerate(point.values)
        if value is not None
    )
    return text.getvalue()


def _recorded(session: Session, ids: Sequence[str]) -> tuple[tuple[ExperimentRow, ...], dict[str, FloatArray]]:
    """Return the experiments, and the recorded fitness of each: `(repetitions, iterations + 1)`, nan if missing."""
    rows = experiments.get_experiments(session, ids)
    found = results.recorded(session, ids)
    values = {row.id: np.full((row.spec["repetitions"], row.iterations), np.nan) for row in rows}
    for experiment, repetition, iteration, fitness in found:
        values[experiment][repetition, iteration] = fitness
    return rows, values


def _curve(row: ExperimentRow, values: FloatArray) -> Curve:
    spec = spec_of(row.spec)
    return Curve(
        experiment=row.id,
        name=row.name,
        strategy=row.strategy,
        state=row.state,
        unit=unit(spec),
        direct=is_direct(spec),
        level=row.iterations == 1,
        points=curve_points(values),
    )
