"""What experiments spent at each real-world evaluation: rollouts, time or cost by a model that comes with a question.

No spec has the model, so anyone may ask later, with the prices of their own machine, robot and people.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean

from gaplab.schemas.comparisons import Comparison
from gaplab.schemas.costs import CostModel
from gaplab.schemas.curves import Curve
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.figures.kinds.curves import CostAxis
from gaplab.services.findings.comparisons import Compared
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import results
from gaplab.services.store.session import Session, Store

Point = tuple[str, int]
"""Experiment and number of real-world evaluations."""

SCALES = ((1.0, ""), (1e3, "thousands"), (1e6, "millions"), (1e9, "thousand millions"))
UNITS_OF_TIME = ((1.0, "s"), (60.0, "min"), (3600.0, "h"), (86_400.0, "d"))

LEAST_IN_UNIT = 3.0
"""The greatest value in a unit must be at least this, or a smaller unit is used."""


UNMEASURED = "the time of simulation is not stored"


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


def cost_axis(store: Store, curves: Sequence[Curve], model: CostModel) -> CostAxis:
    """Return the horizontal axis for curves that are drawn against what they spent.

    The level of a strategy without samples has no place on it.
    """
    with store.reading() as session:
        means = _mean_costs(results.iteration_costs(session, [curve.experiment for curve in curves if not curve.level]))
    costs = {point: model.of(point[1], *each) for point, each in means.items()}
    scale, unit = _suited(max(costs.values(), default=0.0), model)
    label = {"rollouts": "Rollouts in simulation", "time": "Time", "cost": "Cost"}[model.x]
    unmeasured = model.measures and means and not any(seconds for _, seconds in means.values())
    return CostAxis(
        label=f"{label} ({unit})" if unit else label,
        note=f"{model.note} {UNMEASURED[0].upper()}{UNMEASURED[1:]}." if unmeasured else model.note,
        at={point: value / scale for point, value in costs.items()},
    )


def _suited(most: float, model: CostModel) -> tuple[float, str]:
    """Return the largest scale on which the greatest number is at least `LEAST_IN_UNIT`; a cost has none."""
    scales = {"rollouts": SCALES, "time": UNITS_OF_TIME}.get(model.x, ((1.0, ""),))
    return next((each for each in reversed(scales) if most >= LEAST_IN_UNIT * each[0]), scales[0])


def in_words(amount: float, model: CostModel) -> str:
    """Return what was spent, like `2.5 h`, `12,000 rollouts` or `a cost of 40`."""
    if model.x == "rollouts":
        return f"{amount:,.0f} rollouts"
    scale, unit = _suited(amount, model)
    return f"{amount / scale:.4g} {unit}" if unit else f"a cost of {amount:.4g}"


@dataclass(frozen=True)
class EqualCost:
    """What experiments are compared at.

    Attributes:
        amount: rollouts, seconds or cost.
        counts: by experiment, the last number of real-world evaluations that it had for it. None: it ended with less,
            so nobody knows what it would have reached, or it had none yet.
        where: the amount in words.
    """

    amount: float
    counts: Mapping[str, int | None]
    where: str

    def applied(self, compared: Iterable[Compared]) -> list[Compared]:
        """Return experiments after the numbers of evaluations that they had for it; without a number, as they are."""
        return [each.after(self.counts[each.id]) if each.id in self.counts else each for each in compared]

    def told(self, pairs: Iterable[Comparison]) -> Iterator[Comparison]:
        """Yield the pairs with what both spent, and the numbers of real-world evaluations that each had for it."""
        for pair in pairs:
            numbers = [self.counts.get(pair.first), self.counts.get(pair.second)]
            there = [number for number in numbers if number is not None] or [0]
            counts = {"evaluations_first": numbers[0], "evaluations_second": numbers[1]}
            ends = {"from_evaluations": min(there), "to_evaluations": max(there)}
            yield pair.model_copy(update={"cost": self.amount, **counts, **ends})


def equal_cost(session: Session, rows: Sequence[ExperimentRow], model: CostModel, at: float | None) -> EqualCost:
    """Return an amount that experiments spent, by default the least that one with samples has spent.

    Raises:
        InvalidSpec: no experiment has spent as much, or the time of simulation counts and is not stored.
    """
    found: dict[str, dict[int, float]] = {row.id: {} for row in rows}
    for (id_, count), (rollouts, seconds) in _mean_costs(results.iteration_costs(session, list(found))).items():
        if model.measures and rollouts and not seconds:
            message = f"{UNMEASURED} of experiment {id_}; give the seconds of a rollout"
            raise InvalidSpec([Violation("rollout_s", None, message, "a number of seconds")])
        found[id_][count] = model.of(count, rollouts, seconds)
    most = {id_: max(costs.values(), default=0.0) for id_, costs in found.items()}
    sampling = [most[row.id] for row in rows if not row.level] or [*most.values(), 0.0]
    amount = min(sampling) if at is None else at
    if amount > max(sampling):
        message = f"no experiment has spent {in_words(amount, model)}; the most is {in_words(max(sampling), model)}"
        raise InvalidSpec([Violation("at", at, message, f"0 to {max(sampling):.6g}")])
    enough = {row.id for row in rows if row.level or most[row.id] >= amount}
    counts = {id_: _last(costs, amount) if id_ in enough else None for id_, costs in found.items()}
    return EqualCost(amount, counts, f"at {in_words(amount, model)}")


def _last(costs: Mapping[int, float], amount: float) -> int | None:
    return max((count for count, cost in costs.items() if cost <= amount), default=None)
