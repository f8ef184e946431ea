"""Timing on a shared, noisy machine: competitors take turns, and ratios are computed within each round."""

from collections.abc import Callable, Sequence
from statistics import median
from time import perf_counter
from typing import NamedTuple, TypeAlias

Clock: TypeAlias = Callable[[], float]


class Row(NamedTuple):
    """One line of the table: a figure, its value with its unit, and its ratio to another, which should be `target`."""

    figure: str
    value: str
    ratio: float
    reference: str
    target: str


def rates(
    competitors: dict[str, Callable[[], int]], rounds: int, clock: Clock = perf_counter
) -> dict[str, list[float]]:
    """Return each competitor's rate in units of its work per second, by round; a first round warms up only."""
    measured: dict[str, list[float]] = {name: [] for name in competitors}
    for round_number in range(rounds + 1):
        for name, work in competitors.items():
            begun = clock()
            units = work()
            if round_number:
                measured[name].append(units / (clock() - begun))
    return measured


def compared(
    competitors: dict[str, Callable[[], int]],
    pairs: Sequence[tuple[str, str, str]],
    rounds: int,
    clock: Clock = perf_counter,
) -> list[Row]:
    """Return the median of the ratios in each round of pairs of competitors, whose third part is the target.

    Pairs of which a competitor is missing are left out.
    """
    measured, rows = rates(competitors, rounds, clock), []
    for one, to, target in pairs:
        if {one, to} <= measured.keys():
            ratio = median(ours / theirs for ours, theirs in zip(measured[one], measured[to], strict=True))
            rows.append(Row(one, f"{median(measured[one]):.4g} a second", ratio, to, target))
    return rows
