"""The tables of a comparison, each narrow enough for a terminal."""

from collections.abc import Iterator, Sequence

from rich.markup import escape
from rich.table import Table

from gaplab.api.commands.tables import number, table
from gaplab.schemas.comparison_columns import NAMES, UNPAIRED, shown_tests
from gaplab.schemas.comparisons import Comparison, Groups, Summary


def comparisons(pairs: Sequence[Comparison]) -> Iterator[Table | str]:
    """Yield the experiments, the differences of their pairs, the tests, and the verdicts that were asked for."""
    yield from dict.fromkeys(f"! {escape(warning)}\n" for pair in pairs for warning in pair.warnings)
    yield f"{pairs[0].fitness.words} in reality, {pairs[0].where}; 95 % intervals"
    yield table(("experiment", "n", "mean", "interquartile mean", "SD"), map(_experiment, *_summaries(pairs)))
    yield "Differences with 90 % intervals, Cohen's d, and the probability that a repetition of the first is fitter"
    yield table(("first", "second", "n", "difference", "d", "P(first > second)"), map(_sizes, pairs))
    yield "p with Holm's correction over all pairs, and in brackets the raw p"
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
    return escape(name), f"{one.n}", escape(one.mean.text), escape(one.interquartile_mean.text), number(one.sd)


def _sizes(pair: Comparison) -> tuple[str, ...]:
    numbers = (pair.sizes, pair.difference_text, pair.effect_size_text, pair.improvement.text)
    return escape(pair.first_name), escape(pair.second_name), *map(escape, numbers)


def _tests(pairs: Sequence[Comparison], tested: Sequence[Groups], names: Sequence[str]) -> Table:
    rows = [
        (escape(pair.first_name), escape(pair.second_name), *(getattr(tests, name).text for name in names))
        for pair, tests in zip(pairs, tested, strict=True)
    ]
    return table(("first", "second", *(f"p {NAMES[test]}" for test in names)), rows)


def _names(pair: Comparison) -> str:
    return f"{escape(pair.first_name)} - {escape(pair.second_name)}"
