"""Steps to rows and back: the log that is read equals the log that was written, number by number."""

from collections.abc import Iterable, Mapping, Sequence
from math import inf, isfinite, nan
from typing import Any

from gaplab.schemas.records import MeasurementKind
from gaplab.schemas.sensitivity import Checked
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.types import Cost, Measured, Probed, Sample, Selected, Simulator, Step, Transferred, Tuned
from gaplab.services.store.models import IterationRow, MeasurementRow, SimulatorRow

_ORDER: tuple[type[Step], ...] = (Selected, Measured, Tuned, Transferred, Probed)


def position(step: Step) -> int:
    """The step's place in the log of its repetition, from 0; iteration 0 has no Selected and no Measured."""
    return len(_ORDER) * step.iteration + _ORDER.index(type(step)) - _ORDER.index(Tuned)


def opens_iteration(step: Step) -> bool:
    """Whether the step is the first of its iteration."""
    return isinstance(step, Selected) or (isinstance(step, Tuned) and step.iteration == 0)


def cost(step: Step) -> Cost:
    """What the step took; asking reality takes no rollouts."""
    return getattr(step, "cost", Cost())


def iteration_columns(step: Step) -> dict[str, Any]:
    """The columns of its iteration that the step fills."""
    match step:
        case Selected():
            return {"selected_genome": vector(step.genome), **_phase("selection", step.cost)}
        case Tuned():
            return _phase("tuning", step.cost)
        case Transferred():
            found = {"transferred_genome": vector(step.genome), "simulated_fitness": finite(step.fitness)}
            return found | _phase("transfer", step.cost)
        case Probed():
            return {"recorded_fitness": finite(step.recorded)}
        case Measured():
            return {}


def simulator_columns(step: Tuned) -> list[dict[str, Any]]:
    """One row for each simulator of the step."""
    return [
        {"rank": rank, "parameters": vector(each.parameters), "squared_error": finite(each.squared_error)}
        for rank, each in enumerate(step.simulators)
    ]


def measurement_columns(step: Measured | Probed, measured_by: str) -> dict[str, Any]:
    """One row; a probe's genome is the one that was transferred, which its step does not repeat."""
    if isinstance(step, Probed):
        return {"fitness": finite(step.fitness), "measured_by": measured_by}
    genome, fitness = vector(step.sample.genome), finite(step.sample.fitness)
    return {"genome": genome, "fitness": fitness, "measured_by": measured_by}


def log(
    iterations: Iterable[IterationRow], measurements: Iterable[MeasurementRow], simulators: Iterable[SimulatorRow]
) -> tuple[Step, ...]:
    """The steps that one repetition's rows tell of.

    Args:
        iterations: by number.
        measurements: in any order.
        simulators: by iteration and rank.
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


def checked(spec: Mapping[str, Any]) -> Checked:
    """What a sensitivity check of this resolved spec looks at."""
    return Checked.model_validate({name: spec[name] for name in ("robot", "engine", "tunables")})


def vector(values: FloatArray) -> list[float]:
    """A JSON array; its numbers read back exactly."""
    return [float(each) for each in values]


def finite(value: float) -> float | None:
    """NULL for nan and the infinities."""
    return float(value) if isfinite(value) else None


def _phase(name: str, cost: Cost) -> dict[str, int]:
    return {f"{name}_{count}": int(getattr(cost, count)) for count in ("rollouts", "failures", "saved")}


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
    return Measured(row.iteration, Sample(frozen(row.genome), _or(nan, row.fitness)))


def _tuned(row: IterationRow, simulators: Sequence[SimulatorRow]) -> Tuned | None:
    if row.tuning_rollouts is None:
        return None
    found = tuple(Simulator(frozen(each.parameters), _or(inf, each.squared_error)) for each in simulators)
    return Tuned(row.number, found, _cost(row.tuning_rollouts, row.tuning_failures, row.tuning_saved))


def _transferred(row: IterationRow) -> Transferred | None:
    if row.transferred_genome is None:
        return None
    spent = _cost(row.transfer_rollouts, row.transfer_failures, row.transfer_saved)
    return Transferred(row.number, frozen(row.transferred_genome), _or(nan, row.simulated_fitness), spent)


def _probed(row: IterationRow, probe: MeasurementRow | None) -> Probed | None:
    if probe is None:
        return None
    return Probed(row.number, _or(nan, probe.fitness), _or(nan, row.recorded_fitness))


def _cost(rollouts: int | None, failures: int | None, saved: int | None) -> Cost:
    return Cost(rollouts or 0, failures or 0, saved or 0)


def _or(missing: float, value: float | None) -> float:
    return missing if value is None else value
