"""Timing that a shared, noisy machine cannot fool: rivals take turns, and ratios are taken turn by turn."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from time import perf_counter


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        figure: what was measured.
        value: as it is printed, with its unit.
        ratio: to `reference`, if it is a ratio.
        reference: what it is compared with.
        target: what was aimed at, as it is printed.
    """

    figure: str
    value: str
    ratio: float | None = None
    reference: str = ""
    target: str = ""


def rates(rivals: dict[str, Callable[[], int]], rounds: int) -> dict[str, list[float]]:
    """Each rival's rate in units of work per second, turn by turn; a first turn warms up and does not count.

    Args:
        rivals: each does some work and says how many units it was.
        rounds: turns that count.
    """
    measured: dict[str, list[float]] = {name: [] for name in rivals}
    for turn in range(rounds + 1):
        for name, work in rivals.items():
            begun = perf_counter()
            units = work()
            if turn:
                measured[name].append(units / (perf_counter() - begun))
    return measured


def ratio(ours: Sequence[float], theirs: Sequence[float]) -> float:
    """The median of the ratios turn by turn."""
    return median(our / their for our, their in zip(ours, theirs, strict=True))
