"""Which strategies differ in a study: means with letters. Strategies that no test tells apart share a letter."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import combinations
from string import ascii_lowercase

from benchmarks.reproduction import paper, statements
from benchmarks.reproduction.studies import Study
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.equivalence import SIGNIFICANT
from gaplab.services.core.statistics import holm
from gaplab.services.figures.words import number_of, spoken
from gaplab.services.reports.numbers import MISSING

RANGES = ((0, 0), (1, 1), (3, paper.ITERATIONS), (6, paper.ITERATIONS))
"""First and last number of samples: before any, and those of the paper's tests."""


def head(study: Study) -> tuple[str, ...]:
    """Return the head of the table: the ranges that the study has."""
    return "strategy", *(_told(first, last) for first, last in _ranges(study))


def rows(study: Study) -> Iterator[tuple[str, ...]]:
    """Yield a row for each of the paper's strategies: its mean over direct in each range, with its letters."""
    columns = [_column(study, first, last) for first, last in _ranges(study)]
    for name in study.present:
        yield spoken(name), *(column[name] for column in columns)


def letters(names: Sequence[str], differing: Collection[frozenset[str]]) -> dict[str, str]:
    """Return the letters of each name; two names share one exactly if they do not differ.

    A letter stands for a largest set of names without a differing pair, as in Piepho 2004.

    Args:
        names: in the order in which the sets get their letters.
        differing: the pairs that differ.
    """
    alike = [
        frozenset(some)
        for size in range(len(names), 0, -1)
        for some in combinations(names, size)
        if not any(frozenset(pair) in differing for pair in combinations(some, 2))
    ]
    largest = [some for some in alike if not any(some < other for other in alike)]
    ordered = sorted(largest, key=lambda some: sorted(map(names.index, some)))
    return {
        name: "".join(letter for letter, some in zip(ascii_lowercase, ordered, strict=False) if name in some)
        for name in names
    }


def _ranges(study: Study) -> list[tuple[int, int]]:
    return [(first, min(last, study.last)) for first, last in RANGES if first <= study.last]


def _told(first: int, last: int) -> str:
    if not last:
        return "before any"
    return f"after {number_of('sample', first)}" if first == last else f"over {first} to {last} samples"


def _column(study: Study, first: int, last: int) -> Mapping[str, str]:
    """Return the mean of each strategy with its letters; without letters before any sample, when all do the same."""
    values = {name: own for name in study.present if len(own := study.values(name, first, last))}
    means = {name: float(own.mean()) / study.unit for name, own in values.items()}
    found = letters(sorted(means, key=means.__getitem__, reverse=True), _differing(values)) if last else {}
    return {
        name: f"{means[name]:.2f} {found.get(name, '')}".rstrip() if name in means else MISSING
        for name in study.present
    }


def _differing(values: Mapping[str, FloatArray]) -> set[frozenset[str]]:
    """Return the pairs that Welch's t tells apart after Holm's correction."""
    pairs = list(combinations(values, 2))
    corrected = holm([statements.differ(values[one], values[other]) for one, other in pairs])
    return {frozenset(pair) for pair, p in zip(pairs, corrected, strict=True) if p is not None and p < SIGNIFICANT}
