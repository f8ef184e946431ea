"""Comparisons as tables that leave the service: CSV for programs, LaTeX for papers."""

import re
from collections.abc import Iterable, Iterator, Sequence

from gaplab.schemas.comparison_columns import COLUMNS, UNPAIRED, row, shown_tests
from gaplab.schemas.comparisons import Comparison, Estimate, Groups, Summary, Test
from gaplab.services.core.csv_tables import csv_text

NAMES = {
    "student": "Student",
    "welch": "Welch",
    "mann_whitney": "Mann--Whitney",
    "paired_t": "Paired $t$",
    "wilcoxon": "Wilcoxon",
    "brown_forsythe": "Brown--Forsythe",
}

WORDS = {"First", "Second", "Experiment", "Verdict"}
"""Columns of words, which are set to the left."""

SMALLEST_P = 0.001
"""Smallest p-value that is written as a number."""

_SPECIAL = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
} | {sign: f"\\{sign}" for sign in "&%$#_{}"}


def comparisons_csv(comparisons: Sequence[Comparison]) -> str:
    """Return a line for each pair, with every number of every test; an undefined number is empty."""
    return csv_text(COLUMNS, map(row, comparisons))


def comparisons_latex(comparisons: Sequence[Comparison], unit: str) -> str:
    """Return tables for the package booktabs: the pairs, the experiments, and over a range the paper's pooled tests.

    The comparisons have one range of real-world evaluations; the unit is "" if fitness has none.
    """
    return "\n".join([_pairs(comparisons, unit), _experiments(comparisons, unit), *_pooled(comparisons)])


def _pairs(comparisons: Sequence[Comparison], unit: str) -> str:
    tests = shown_tests(comparisons)
    margins = {pair.equivalence.margin for pair in comparisons if pair.equivalence}
    head = ["First", "Second", "$n$", "Difference", "$d$", "$P(>)$", *(NAMES[test] for test in tests)]
    head += ["Verdict"] if margins else []
    rows = [
        [*_names(pair), *_sizes(pair, pair), _estimate(pair.improvement), *_tests(pair, tests), *_verdict(pair)]
        for pair in comparisons
    ]
    caption = [
        f"{_what(comparisons[0], unit)}: differences with 90\\,\\% intervals",
        "Cohen's $d$",
        "$P(>)$, the probability that a repetition of the first is fitter, with its 95\\,\\% interval",
        "two-sided $p$-values, in brackets with Holm's correction over all pairs",
        *(["paired tests by repetition where two experiments share random streams"] if "paired_t" in tests else []),
        *[f"equivalence within $\\pm{margin:.3g}$ by two one-sided tests" for margin in margins],
    ]
    return _table("; ".join(caption), head, rows)


def _experiments(comparisons: Sequence[Comparison], unit: str) -> str:
    found: dict[str, tuple[str, Summary]] = {}
    for pair in comparisons:
        found[pair.first] = pair.first_name, pair.summary_first
        found[pair.second] = pair.second_name, pair.summary_second
    rows = [
        [_name(name), str(one.n), _estimate(one.mean), _estimate(one.interquartile_mean), _plain(one.sd)]
        for name, one in found.values()
    ]
    caption = f"{_what(comparisons[0], unit)}, with 95\\,\\% intervals"
    return _table(caption, ["Experiment", "$n$", "Mean", "Interquartile mean", "SD"], rows)


def _pooled(comparisons: Sequence[Comparison]) -> Iterator[str]:
    pooled = [(pair, pair.pooled) for pair in comparisons if pair.pooled]
    if not pooled:
        return
    rows = [[*_names(pair), *_sizes(tests, None), *_tests(tests, UNPAIRED)] for pair, tests in pooled]
    caption = f"The same pairs, {escaped(pooled[0][1].caution)}; $p$-values as above"
    yield _table(caption, ["First", "Second", "$n$", "Difference", "$d$", *(NAMES[test] for test in UNPAIRED)], rows)


def _table(caption: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    return "\n".join(
        [
            r"\begin{table}",
            r"  \centering",
            f"  \\caption{{{caption}.}}",
            f"  \\begin{{tabular}}{{{''.join('l' if each in WORDS else 'r' for each in head)}}}",
            r"    \toprule",
            f"    {' & '.join(head)} \\\\",
            r"    \midrule",
            *(f"    {' & '.join(cells)} \\\\" for cells in rows),
            r"    \bottomrule",
            r"  \end{tabular}",
            r"\end{table}",
            "",
        ]
    )


def escaped(text: str) -> str:
    """Return a text whose signs LaTeX prints as they are."""
    return "".join(_SPECIAL.get(sign, sign) for sign in re.sub(r"\s+", " ", text))


def _what(pair: Comparison, unit: str) -> str:
    return escaped(f"{pair.fitness.words}{f' in {unit}' if unit else ''}, {pair.where}")


def _name(name: str) -> str:
    return escaped(name.replace("_", " "))


def _names(pair: Comparison) -> list[str]:
    return [_name(pair.first_name), _name(pair.second_name)]


def _sizes(groups: Groups, pair: Comparison | None) -> list[str]:
    interval = _interval(pair.lower, pair.upper) if pair else ""
    sizes = pair.sizes if pair else f"{groups.n_first}, {groups.n_second}"
    return [sizes, _signed(groups.difference) + interval, _signed(groups.effect_size)]


def _tests(groups: Groups, names: Iterable[str]) -> list[str]:
    tests: list[Test] = [getattr(groups, name) for name in names]
    return [_both(test.p, test.p_holm) for test in tests]


def _both(p: float | None, p_holm: float | None) -> str:
    return "--" if p is None else f"{_probability(p)} ({_probability(p_holm)})"


def _verdict(pair: Comparison) -> list[str]:
    found = pair.equivalence
    return [f"{found.verdict.value}, {_both(found.p, found.p_holm)}"] if found else []


def _estimate(found: Estimate) -> str:
    return _plain(found.value) + _interval(found.lower, found.upper)


def _interval(lower: float | None, upper: float | None) -> str:
    return "" if lower is None or upper is None else f" $[{lower:.2f}, {upper:.2f}]$"


def _plain(value: float | None) -> str:
    return "--" if value is None else f"${value:.2f}$"


def _signed(value: float | None) -> str:
    return "--" if value is None else f"${value:+.2f}$"


def _probability(p: float | None) -> str:
    if p is None:
        return "--"
    return f"$<{SMALLEST_P}$" if p < SMALLEST_P else f"${p:.3f}$"
