"""Comparisons as tables that leave the service: CSV for programs, LaTeX for papers."""

import csv
import io
import re
from collections.abc import Iterator, Sequence

from gaplab.schemas.curves import Comparison, Test
from gaplab.services.results.texts import cell

TESTS = {"student": "Student", "welch": "Welch", "mann_whitney": "Mann--Whitney"}
"""The tests of a comparison, with the name of each in LaTeX."""

ABOUT = ("first", "first_name", "second", "second_name", "from_evaluations", "to_evaluations", "n_first", "n_second")
SIZES = ("difference", "effect_size")
OF_A_TEST = ("statistic", "degrees_of_freedom", "p", "p_holm")
COLUMNS = (*ABOUT, *SIZES, *(f"{test}_{value}" for test in TESTS for value in OF_A_TEST))

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
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(_values(pair) for pair in comparisons)
    return text.getvalue()


def comparisons_latex(comparisons: Sequence[Comparison], unit: str) -> str:
    """Return a table for the package booktabs: a row for each pair, p-values with Holm's correction.

    Args:
        comparisons: pairs over one range of real-world evaluations.
        unit: unit of fitness; "" if it has none.
    """
    first, last = comparisons[0].from_evaluations, comparisons[0].to_evaluations
    counts = f"{first} real-world evaluation{'' if first == 1 else 's'}"
    where = f"after {counts}" if first == last else f"pooled over {first} to {last} real-world evaluations"
    units = f" in {escaped(unit)}" if unit else ""
    return "\n".join(
        [
            r"\begin{table}",
            r"  \centering",
            f"  \\caption{{Differences of mean fitness in reality{units}, {where}; Cohen's $d$; two-sided $p$-values "
            r"with Holm's correction over all pairs.}",
            r"  \begin{tabular}{llrrrrrr}",
            r"    \toprule",
            f"    First & Second & $n$ & Difference & $d$ & {' & '.join(TESTS.values())} \\\\",
            r"    \midrule",
            *(f"    {' & '.join(_row(pair))} \\\\" for pair in comparisons),
            r"    \bottomrule",
            r"  \end{tabular}",
            r"\end{table}",
            "",
        ]
    )


def escaped(text: str) -> str:
    """Return a text whose signs LaTeX prints as they are."""
    return "".join(_SPECIAL.get(sign, sign) for sign in re.sub(r"\s+", " ", text))


def _values(pair: Comparison) -> Iterator[object]:
    yield from (cell(value) if isinstance(value := getattr(pair, name), str) else value for name in (*ABOUT, *SIZES))
    yield from (getattr(getattr(pair, test), value) for test in TESTS for value in OF_A_TEST)


def _row(pair: Comparison) -> list[str]:
    names = [escaped(name.replace("_", " ")) for name in (pair.first_name, pair.second_name)]
    sizes = [_signed(pair.difference), _signed(pair.effect_size)]
    tests: list[Test] = [getattr(pair, test) for test in TESTS]
    return [*names, f"{pair.n_first}, {pair.n_second}", *sizes, *(_probability(test.p_holm) for test in tests)]


def _signed(value: float | None) -> str:
    return "--" if value is None else f"${value:+.2f}$"


def _probability(p: float | None) -> str:
    if p is None:
        return "--"
    return f"$<{SMALLEST_P}$" if p < SMALLEST_P else f"${p:.3f}$"
