"""The tables of a comparison, each narrow enough for a terminal."""

from collections.abc import Iterator, Sequence

from rich.markup import escape
from rich.table import Table

from gaplab.api.commands.tables import number, table
from gaplab.schemas.comparison_columns import UNPAIRED, shown_tests
from gaplab.schemas.comparisons import Comparison, Estimate, Groups, Summary, Test

NAMES = {
    "student": "p Student",
    "welch": "p Welch",
    "mann_whitney": "p Mann-Whitney",
    "paired_t": "p paired t",
    "wilcoxon": "p Wilcoxon",
    "brown_forsythe": "p of the spread",
}


def comparisons(pairs: Sequence[Comparison]) -> Iterator[Table | str]:
    """Yield the experiments, the differences of their pairs, the tests, and the verdicts that were asked for."""
    yield from dict.fromkeys(f"! {escape(warning)}\n" for pair in pairs for warning in pair.warnings)
    yield f"{pairs[0].fitness.words} in reality, {pairs[0].where}; 95 % intervals"
    yield table(("experiment", "n", "mean", "interquartile mean", "SD"), map(_experiment, *_summaries(pairs)))
    yield "Differences with 90 % intervals, Cohen's d, and the probability that a repetition of the first is fitter"
    yield table(("first", "second", "n", "difference", "d", "P(first > second)"), map(_sizes, pairs))
    yield "p, and in brackets p with Holm's correction over all pairs"
    yield _tests(pairs, pairs, shown_tests(pairs))
    yield from dict.fromkeys(f"! {_names(pair)}: {escape(pair.caution)}\n" for pair in pairs if pair.caution)
    pooled = [pair.pooled for pair in pairs if pair.pooled]
    if pooled:
        yield f"The same pairs, {pooled[0].caution}"
        yield _tests(pairs, pooled, UNPAIRED)
    yield from (f"{_names(pair)}: {pair.equivalence.words}\n" for pair in pairs if pair.equivalence)


def _summaries(pairs: Sequence[Comparison]) -> tuple[list[str], list[Summary]]:
    found = {pair.first: (pair.first_name, pair.summary_first) for pair in pairs}
    found |= {pair.second: (pair.second_name, pair.summary_second) for pair in pairs}
    return [name for name, _ in found.values()], [one for _, one in found.values()]


def _experiment(name: str, one: Summary) -> tuple[str, ...]:
    return escape(name), f"{one.n}", _estimate(one.mean), _estimate(one.interquartile_mean), number(one.sd)


def _sizes(pair: Comparison) -> tuple[str, ...]:
    difference = _signed(pair.difference) + _interval(pair.lower, pair.upper)
    numbers = (difference, _signed(pair.effect_size), _estimate(pair.improvement))
    return escape(pair.first_name), escape(pair.second_name), f"{pair.n_first}, {pair.n_second}", *numbers


def _tests(pairs: Sequence[Comparison], tested: Sequence[Groups], names: Sequence[str]) -> Table:
    rows = [
        (escape(pair.first_name), escape(pair.second_name), *(_p(getattr(tests, name)) for name in names))
        for pair, tests in zip(pairs, tested, strict=True)
    ]
    return table(("first", "second", *(NAMES[test] for test in names)), rows)


def _names(pair: Comparison) -> str:
    return f"{escape(pair.first_name)} - {escape(pair.second_name)}"


def _p(test: Test) -> str:
    return "-" if test.p is None else f"{number(test.p)} ({number(test.p_holm)})"


def _estimate(found: Estimate) -> str:
    return number(found.value) + _interval(found.lower, found.upper)


def _interval(lower: float | None, upper: float | None) -> str:
    return "" if lower is None or upper is None else f" \\[{lower:.3g}, {upper:.3g}]"


def _signed(value: float | None) -> str:
    return "-" if value is None else f"{value:+.3g}"
