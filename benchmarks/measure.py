"""Timing on a shared, noisy machine: competitors take turns, and ratios are computed within each round."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from time import perf_counter


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        figure: name of the measurement.
        value: printed value with its unit.
        ratio: ratio to `reference`, if any.
        reference: name of the measurement to compare with.
        target: printed target.
    """

    figure: str
    value: str
    ratio: float | None = None
    reference: str = ""
    target: str = ""


def rates(competitors: dict[str, Callable[[], int]], rounds: int) -> dict[str, list[float]]:
    """Return each competitor's rate in units of work per second, by round. A first round warms up and does not count.

    Args:
        competitors: functions that do some work and return its number of units.
        rounds: rounds that count.
    """
    measured: dict[str, list[float]] = {name: [] for name in competitors}
    for round_number in range(rounds + 1):
        for name, work in competitors.items():
            begun = perf_counter()
            units = work()
            if round_number:
                measured[name].append(units / (perf_counter() - begun))
    return measured


def ratio(ours: Sequence[float], theirs: Sequence[float]) -> float:
    """Return the median of the ratios in each round."""
    return median(our / their for our, their in zip(ours, theirs, strict=True))
