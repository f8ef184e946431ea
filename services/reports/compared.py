"""The tables of a report that compare experiments."""

from collections.abc import Iterable, Iterator, Sequence

from gaplab.schemas.comparison_columns import NAMES, UNPAIRED, shown_tests
from gaplab.schemas.comparisons import Comparison, Groups, Summary
from gaplab.services.findings.wording import number
from gaplab.services.reports.blocks import Grid
from gaplab.services.reports.content import Facts


def summaries(facts: Facts, compared: Sequence[Comparison], caption: str) -> Grid:
    """Return mean and interquartile mean of each experiment, with their intervals."""
    found: dict[str, Summary] = {}
    for pair in compared:
        found |= {pair.first: pair.summary_first, pair.second: pair.summary_second}
    rows = tuple(
        (facts.names[key], f"{one.n}", one.mean.text, one.interquartile_mean.text, number(one.sd))
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
        "p after Holm (raw)",
        "The first is",
    )
    rows = tuple(
        (
            *_pair(facts, pair),
            pair.sizes,
            pair.difference_text,
            pair.effect_size_text,
            pair.improvement.text,
            "paired t" if pair.shared_streams else "Welch",
            pair.trusted.text,
            pair.trusted.found.value,
            *([pair.equivalence.verdict.value] if pair.equivalence else []),
        )
        for pair in compared
    )
    margins = {pair.equivalence.margin for pair in compared if pair.equivalence}
    return Grid(caption, (*head, *(f"Within ±{number(margin)}" for margin in margins)), rows)


def tests(facts: Facts, compared: Sequence[Comparison], caption: str) -> Grid:
    """Return p of each test of all pairs, after Holm's correction and raw."""
    shown = shown_tests(compared)
    rows = tuple((*_pair(facts, pair), *_p_of(pair, shown)) for pair in compared)
    head = ("Pair", *(NAMES[test] for test in shown))
    return Grid(f"{caption}: p after Holm's correction, and in brackets the raw p", head, rows)


def pooled(facts: Facts, compared: Sequence[Comparison], caption: str) -> Grid:
    """Return the paper's tests of all pairs over a range."""
    rows = tuple(
        (*_pair(facts, pair), found.sizes, found.difference_text, *_p_of(found, UNPAIRED))
        for pair in compared
        if (found := pair.pooled)
    )
    return Grid(caption, ("Pair", "n", "Difference", *(NAMES[test] for test in UNPAIRED)), rows)


def _pair(facts: Facts, pair: Comparison) -> tuple[str]:
    return (f"{facts.names[pair.first]} − {facts.names[pair.second]}",)


def _p_of(groups: Groups, names: Iterable[str]) -> Iterator[str]:
    return (getattr(groups, name).text for name in names)
