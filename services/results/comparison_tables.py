"""Comparisons as tables that leave the service: CSV for programs, LaTeX for papers."""

import re
from collections.abc import Iterable, Iterator, Sequence

from gaplab.schemas.comparison_columns import COLUMNS, NAMES, UNPAIRED, row, shown_tests
from gaplab.schemas.comparisons import Comparison, Groups, Summary
from gaplab.services.core.csv_tables import csv_text
from gaplab.services.findings.wording import number, probabilities

WORDS = {"First", "Second", "Experiment", "Verdict"}
"""Columns of words, which are set to the left."""

_SPECIAL = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
} | {sign: f"\\{sign}" for sign in "&%$#_{}"}

_NUMBER = re.compile(r"(< )?[+\N{MINUS SIGN}]?\d[\d.e\N{MINUS SIGN}]*")
_SIGNS = {ord("\N{EN DASH}"): "--", ord("\N{MINUS SIGN}"): "-"}


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
        [*_names(pair), *_sizes(pair), _math(pair.improvement.text), *_p_of(pair, tests), *_verdict(pair)]
        for pair in comparisons
    ]
    caption = [
        f"{_what(comparisons[0], unit)}: differences with 90\\,\\% intervals",
        "Cohen's $d$",
        "$P(>)$, the probability that a repetition of the first is fitter, with its 95\\,\\% interval",
        "two-sided $p$-values with Holm's correction over all pairs, in brackets without",
        *(["paired tests by repetition where two experiments share random streams"] if "paired_t" in tests else []),
        *[f"equivalence within $\\pm{number(margin)}$ by two one-sided tests" for margin in margins],
    ]
    return _table("; ".join(caption), head, rows)


def _experiments(comparisons: Sequence[Comparison], unit: str) -> str:
    found: dict[str, tuple[str, Summary]] = {}
    for pair in comparisons:
        found[pair.first] = pair.first_name, pair.summary_first
        found[pair.second] = pair.second_name, pair.summary_second
    rows = [
        [_name(name), str(one.n), *map(_math, (one.mean.text, one.interquartile_mean.text, number(one.sd)))]
        for name, one in found.values()
    ]
    caption = f"{_what(comparisons[0], unit)}, with 95\\,\\% intervals"
    return _table(caption, ["Experiment", "$n$", "Mean", "Interquartile mean", "SD"], rows)


def _pooled(comparisons: Sequence[Comparison]) -> Iterator[str]:
    pooled = [(pair, pair.pooled) for pair in comparisons if pair.pooled]
    if not pooled:
        return
    rows = [[*_names(pair), *_sizes(tests), *_p_of(tests, UNPAIRED)] for pair, tests in pooled]
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


def _sizes(groups: Groups) -> list[str]:
    return [groups.sizes, *map(_math, (groups.difference_text, groups.effect_size_text))]


def _p_of(groups: Groups, names: Iterable[str]) -> list[str]:
    return [_math(getattr(groups, name).text) for name in names]


def _verdict(pair: Comparison) -> list[str]:
    found = pair.equivalence
    return [f"{found.verdict.value}, {_math(probabilities(found.p, found.p_holm))}"] if found else []


def _math(text: str) -> str:
    """Return a number in words of the service, set in math mode; an undefined one is a dash."""
    return _NUMBER.sub(lambda found: f"${found[0]}$", text).translate(_SIGNS)
