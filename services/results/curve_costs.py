"""Costs of curves: rollouts in simulation, or time, at each number of real-world evaluations."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from statistics import fmean
from typing import Literal

from gaplab.schemas.curves import Curve
from gaplab.services.figures.kinds.curves import CostAxis
from gaplab.services.store.queries import results
from gaplab.services.store.session import Store

Cost = Literal["rollouts", "time"]

Point = tuple[str, int]
"""Experiment and number of real-world evaluations."""

SCALES = ((1.0, ""), (1e3, "thousands"), (1e6, "millions"), (1e9, "thousand millions"))
UNITS_OF_TIME = ((1.0, "s"), (60.0, "min"), (3600.0, "h"), (86_400.0, "d"))

LEAST_IN_UNIT = 3.0
"""The greatest value in a unit must be at least this, or a smaller unit is used."""


def cost_axis(store: Store, curves: Sequence[Curve], cost: Cost, *, cost_s: float = 0.0) -> CostAxis:
    """Return the horizontal axis for curves that are drawn against their cost.

    Args:
        store: database with the experiments.
        curves: curves of the experiments; a level has no place on the axis.
        cost: the rollouts so far, or the time of simulation and real-world evaluations so far.
        cost_s: seconds that one real-world evaluation takes.
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

    Args:
        rows: as `iteration_costs` returns them, in the order of the log.
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
