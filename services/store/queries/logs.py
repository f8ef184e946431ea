"""Reading of repetitions' logs: the steps equal the recorded ones to the last bit."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from math import inf, nan
from typing import Any, TypeVar

from sqlalchemy import select
from sqlalchemy.orm import Session

from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.arrays import NO_READINGS, FloatArray, Readings, frozen
from gaplab.services.core.types import (
    Cost,
    Fit,
    Measured,
    Probed,
    Sample,
    Selected,
    Simulator,
    Step,
    Transferred,
    Tuned,
)
from gaplab.services.store.models import IterationRow, MeasurementRow, SimulatorRow

R = TypeVar("R", IterationRow, MeasurementRow, SimulatorRow)


def logs(session: Session, repetitions: Sequence[int]) -> dict[int, tuple[Step, ...]]:
    """Return the log of each of these repetitions."""
    iterations = _rows(session, repetitions, IterationRow, IterationRow.number)
    measurements = _rows(session, repetitions, MeasurementRow, MeasurementRow.iteration)
    simulators = _rows(session, repetitions, SimulatorRow, SimulatorRow.iteration, SimulatorRow.rank)
    return {each: _log(iterations[each], measurements[each], simulators[each]) for each in repetitions}


def _rows(session: Session, repetitions: Sequence[int], table: type[R], *order: Any) -> dict[int, list[R]]:  # noqa: ANN401  # columns
    found: Iterable[R] = session.scalars(select(table).where(table.repetition_id.in_(repetitions)).order_by(*order))
    gathered: dict[int, list[R]] = defaultdict(list)
    for row in found:
        gathered[row.repetition_id].append(row)
    return gathered


def _log(
    iterations: Iterable[IterationRow], measurements: Iterable[MeasurementRow], simulators: Iterable[SimulatorRow]
) -> tuple[Step, ...]:
    """Return the steps that one repetition's rows describe.

    Args:
        iterations: iterations by number.
        measurements: measurements in any order.
        simulators: simulators by iteration and rank.
    """
    measured = {(each.iteration, each.kind): each for each in measurements}
    tuned: dict[int, list[SimulatorRow]] = {}
    for each in simulators:
        tuned.setdefault(each.iteration, []).append(each)
    return tuple(
        step
        for row in iterations
        for step in (
            _selected(row),
            _measured(measured.get((row.number, MeasurementKind.SAMPLE))),
            _tuned(row, tuned.get(row.number, ())),
            _transferred(row),
            _probed(row, measured.get((row.number, MeasurementKind.PROBE))),
        )
        if step is not None
    )


def _selected(row: IterationRow) -> Selected | None:
    if row.selected_genome is None:
        return None
    return Selected(
        row.number,
        frozen(row.selected_genome),
        _cost(row.selection_rollouts, row.selection_failures, row.selection_saved),
    )


def _measured(row: MeasurementRow | None) -> Measured | None:
    if row is None:
        return None
    sample = Sample(frozen(row.genome), _or(nan, row.fitness), _readings(row.readings), _repeats(row))
    return Measured(row.iteration, sample)


def _tuned(row: IterationRow, simulators: Sequence[SimulatorRow]) -> Tuned | None:
    if row.tuning_rollouts is None:
        return None
    found = tuple(map(_simulator, simulators))
    return Tuned(row.number, found, _cost(row.tuning_rollouts, row.tuning_failures, row.tuning_saved))


def _simulator(row: SimulatorRow) -> Simulator:
    interval = None if row.lower is None or row.upper is None else frozen(list(zip(row.lower, row.upper, strict=True)))
    error = _or(inf, row.squared_error)
    return Simulator(frozen(row.parameters), error, interval, row.weight, row.held_out_error, fit_of(row.fit))


def fit_of(stored: list[float | None] | None) -> Fit | None:
    """Return the fit of a simulator from its column; None if it is not known."""
    if stored is None or None in stored[:3]:
        return None
    expected, surprise, scale, *errors = _readings(stored).tolist()
    return Fit(expected, surprise, scale, frozen(errors))


def _transferred(row: IterationRow) -> Transferred | None:
    if row.transferred_genome is None:
        return None
    spent = _cost(row.transfer_rollouts, row.transfer_failures, row.transfer_saved)
    return Transferred(row.number, frozen(row.transferred_genome), _or(nan, row.simulated_fitness), spent)


def _probed(row: IterationRow, probe: MeasurementRow | None) -> Probed | None:
    if probe is None:
        return None
    fitnesses = _or(nan, probe.fitness), _or(nan, row.recorded_fitness)
    return Probed(row.number, *fitnesses, _readings(probe.readings), _repeats(probe), probe.left_out)


def _readings(values: list[float | None] | None) -> Readings:
    return frozen([_or(nan, each) for each in values]) if values else NO_READINGS


def _repeats(row: MeasurementRow) -> FloatArray:
    return frozen(row.repeats) if row.repeats else NO_READINGS


def _cost(rollouts: int | None, failures: int | None, saved: int | None) -> Cost:
    return Cost(rollouts or 0, failures or 0, saved or 0)


def _or(missing: float, value: float | None) -> float:
    return missing if value is None else value
