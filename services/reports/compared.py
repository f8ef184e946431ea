"""The tables of a report that compare experiments."""

from collections.abc import Iterable, Iterator, Sequence

from gaplab.schemas.comparison_columns import UNPAIRED, shown_tests
from gaplab.schemas.comparisons import Comparison, Estimate, Groups, Summary, Test
from gaplab.services.reports.blocks import Grid
from gaplab.services.reports.content import Facts
from gaplab.services.reports.judged import SIGNIFICANT
from gaplab.services.reports.numbers import MISSING, fixed, interval, probability, signed

NAMES = {
    "student": "Student",
    "welch": "Welch",
    "mann_whitney": "Mann-Whitney",
    "paired_t": "Paired t",
    "wilcoxon": "Wilcoxon",
    "brown_forsythe": "Spread (Brown-Forsythe)",
}


def summaries(facts: Facts, compared: Sequence[Comparison], caption: str) -> Grid:
    """Return mean and interquartile mean of each experiment, with their intervals."""
    found: dict[str, Summary] = {}
    for pair in compared:
        found |= {pair.first: pair.summary_first, pair.second: pair.summary_second}
    rows = tuple(
        (facts.names[key], f"{one.n}", _estimate(one.mean), _estimate(one.interquartile_mean), fixed(one.sd))
        for key, one in found.items()
    )
    return Grid(f"{caption}, with 95 % intervals", ("Experiment", "n", "Mean", "Interquartile mean", "SD"), rows)


def pairs(facts: Facts, compared: Sequence[Comparison], caption: str) -> Grid:
    """Return all pairs with the difference of their means, the effect size, and the verdict of the trusted test."""
    head = (
        "Pair",
        "n",
        "Difference (90 %)",
        "Cohen's d",
        "P(first > second)",
        "Trusted test",
        "p",
        "p (Holm)",
        "Differs",
    )
    rows = tuple(
        (
            *_pair(facts, pair),
            pair.sizes,
            f"{signed(pair.difference)} ({interval(pair.lower, pair.upper)})",
            signed(pair.effect_size),
            _estimate(pair.improvement),
            "paired t" if pair.shared_streams else "Welch",
            *map(probability, (pair.trusted.p, pair.trusted.p_holm)),
            MISSING if (p := pair.trusted.p_holm) is None else "yes" if p < SIGNIFICANT else "no",
            *([pair.equivalence.verdict.value] if pair.equivalence else []),
        )
        for pair in compared
    )
    margins = {pair.equivalence.margin for pair in compared if pair.equivalence}
    return Grid(caption, (*head, *(f"Within ±{margin:.3g}" for margin in margins)), rows)


def tests(facts: Facts, compared: Sequence[Comparison], caption: str) -> Grid:
    """Return p of each test of all pairs, with p after Holm's correction in brackets."""
    shown = shown_tests(compared)
    rows = tuple((*_pair(facts, pair), *_tests(pair, shown)) for pair in compared)
    head = ("Pair", *(NAMES[test] for test in shown))
    return Grid(f"{caption}: p, and in brackets p after Holm's correction", head, rows)


def pooled(facts: Facts, compared: Sequence[Comparison], caption: str) -> Grid:
    """Return the paper's tests of all pairs over a range."""
    rows = tuple(
        (*_pair(facts, pair), f"{found.n_first}, {found.n_second}", signed(found.difference), *_tests(found, UNPAIRED))
        for pair in compared
        if (found := pair.pooled)
    )
    return Grid(caption, ("Pair", "n", "Difference", *(NAMES[test] for test in UNPAIRED)), rows)


def _pair(facts: Facts, pair: Comparison) -> tuple[str]:
    return (f"{facts.names[pair.first]} − {facts.names[pair.second]}",)


def _tests(groups: Groups, names: Iterable[str]) -> Iterator[str]:
    for name in names:
        test: Test = getattr(groups, name)
        yield MISSING if test.p is None else f"{probability(test.p)} ({probability(test.p_holm)})"


def _estimate(found: Estimate) -> str:
    if found.lower is None:
        return fixed(found.value)
    return f"{fixed(found.value)} ({interval(found.lower, found.upper)})"
