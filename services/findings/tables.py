"""The tables of findings, each described once: terminals, reports and papers show them."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from gaplab.schemas.comparisons import NAMES, UNPAIRED, Comparison, Groups, shown_tests
from gaplab.schemas.differences import SpecDiff
from gaplab.schemas.misfit import MisfitPoint
from gaplab.schemas.sensitivity import SensitivityRead
from gaplab.services.figures.words import spoken
from gaplab.services.findings.wording import MISSING, number, share

_NUMBER = re.compile(r"((?:< )?[+\N{MINUS SIGN}\N{PLUS-MINUS SIGN}]?\d[\d.e\N{MINUS SIGN}]*)")

_SPECIAL = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    "\N{EN DASH}": "--",
    "\N{MINUS SIGN}": "$-$",
    "\N{PLUS-MINUS SIGN}": r"$\pm$",
} | {sign: f"\\{sign}" for sign in "&%$#_{}"}
"""Signs that LaTeX does not print as they are."""


@dataclass(frozen=True)
class Grid:
    """A table of texts; the first cell of each row is its head.

    Attributes:
        caption: what the table shows.
        words: cells hold words, which are set to the left, not numbers.
    """

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: bool = False


def comparison(pairs: Sequence[Comparison]) -> Iterator[Grid]:
    """Yield the tables of a comparison over one range: its experiments, and its pairs."""
    unit = f" in {pairs[0].unit}" if pairs[0].unit else ""
    what = f"{pairs[0].fitness.words}{unit}, {pairs[0].where}"
    found = {pair.first: pair.first_name for pair in pairs} | {pair.second: pair.second_name for pair in pairs}
    names = {id_: name.replace("_", " ") for id_, name in found.items()}
    yield experiments(names, pairs, what)
    yield differences(names, pairs, f"{what}: differences of all pairs")
    yield verdicts(names, pairs, f"{what}: all pairs, by the test to judge them by")
    yield tests(names, pairs, f"{what}: all pairs, by each test")
    if pairs[0].pooled:
        yield pooled(names, pairs, f"The same pairs, {pairs[0].pooled.caution}")


def experiments(names: Mapping[str, str], pairs: Sequence[Comparison], what: str) -> Grid:
    """Return mean and interquartile mean of each experiment, whose names are given by id."""
    found = {pair.first: pair.summary_first for pair in pairs} | {pair.second: pair.summary_second for pair in pairs}
    counts = {pair.first: pair.evaluations_first for pair in pairs}
    counts |= {pair.second: pair.evaluations_second for pair in pairs}
    at_cost = pairs[0].cost is not None
    rows = tuple(
        (
            names[id_],
            *([MISSING if counts[id_] is None else f"{counts[id_]}"] if at_cost else []),
            *(f"{one.n}", one.mean.text, one.interquartile_mean.text, number(one.sd)),
        )
        for id_, one in found.items()
    )
    head = ("Experiment", *(["Evaluations"] if at_cost else []), "n", "Mean", "Interquartile mean", "SD")
    return Grid(f"{what}, with 95 % intervals", head, rows)


def differences(names: Mapping[str, str], pairs: Sequence[Comparison], what: str) -> Grid:
    """Return the differences of all pairs."""
    rows = tuple(
        (_pair(names, pair), pair.sizes, pair.difference_text, pair.effect_size_text, pair.improvement.text)
        for pair in pairs
    )
    caption = f"{what}, with 90 % intervals, and the probability that a repetition of the first is fitter"
    return Grid(caption, ("Pair", "n", "Difference", "Cohen's d", "P(first > second)"), rows)


def verdicts(names: Mapping[str, str], pairs: Sequence[Comparison], what: str) -> Grid:
    """Return the verdict of the trusted test on all pairs, and whether they are equivalent if that was asked for."""
    rows = tuple(
        (
            _pair(names, pair),
            NAMES[pair.trusted.test],
            pair.trusted.text,
            pair.trusted.found.value,
            *([pair.equivalence.words] if pair.equivalence else []),
        )
        for pair in pairs
    )
    head = ("Pair", "Trusted test", "p after Holm (raw)", "The first is")
    return Grid(what, (*head, "Equivalence by two one-sided tests") if pairs[0].equivalence else head, rows)


def tests(names: Mapping[str, str], pairs: Sequence[Comparison], what: str) -> Grid:
    """Return p of each test of all pairs, after Holm's correction and raw."""
    shown = shown_tests(pairs)
    rows = tuple((_pair(names, pair), *_p_of(pair, shown)) for pair in pairs)
    caption = f"{what}: p after Holm's correction over all pairs, and in brackets the raw p"
    return Grid(caption, ("Pair", *(NAMES[test] for test in shown)), rows)


def pooled(names: Mapping[str, str], pairs: Sequence[Comparison], what: str) -> Grid:
    """Return the paper's tests of all pairs that have them, each repetition as its mean over a range of evaluations."""
    rows = tuple(
        (_pair(names, pair), found.sizes, found.difference_text, *_p_of(found, UNPAIRED))
        for pair in pairs
        if (found := pair.pooled)
    )
    return Grid(what, ("Pair", "n", "Difference", *(NAMES[test] for test in UNPAIRED)), rows)


def tuned(last: Sequence[tuple[str, MisfitPoint]]) -> Grid:
    """Return the tunables of the best simulators of experiments, by name, after their last iterations."""
    several = len(last) > 1
    rows = tuple(
        (
            *([name] if several else []),
            spoken(each.name),
            each.text,
            f"{number(each.least)} to {number(each.greatest)}",
            f"{each.lower:g} to {each.upper:g}",
            each.at_bounds or MISSING,
        )
        for name, point in last
        for each in point.tunables
    )
    head = ("Tunable", "Tuned", "Range", "Bounds", "At a bound")
    caption = "Tuned values after the last iteration: mean ± SD, and range, over repetitions"
    return Grid(caption, ("Experiment", *head) if several else head, rows)


def sensitivity(check: SensitivityRead, robot: str) -> Grid:
    """Return the effect of each tunable on the fitness of a robot, before tuning."""
    head = ("Tunable", "Between", f"Effect ({check.unit})", "Share of the spread", "Roughness", "Failed", "Verdict")
    rows = tuple(
        (
            spoken(found.name),
            f"{found.values[0]:g} to {found.values[-1]:g}",
            number(found.effect),
            share(found.relative_effect),
            number(found.roughness, 2),
            f"{found.failures}",
            found.verdict.value,
        )
        for found in check.tunables
    )
    return Grid(f"Check of {robot} in {spoken(check.spec.engine.name)}", head, rows)


def differing(found: SpecDiff, names: Sequence[str]) -> Grid:
    """Return the settings that differ between columns of these names."""
    rows = tuple((each.setting, *each.texts) for each in found.settings)
    return Grid("Settings that differ", ("Setting", *names), rows, words=True)


def latex(grids: Iterable[Grid]) -> str:
    """Return tables for the package booktabs."""
    return "\n".join(map(_latex, grids))


def _latex(grid: Grid) -> str:
    alignment = "l" * len(grid.head) if grid.words else f"l{'r' * (len(grid.head) - 1)}"
    written = escaped if grid.words else _math
    lines = [
        r"\begin{table}",
        r"  \centering",
        f"  \\caption{{{escaped(grid.caption)}.}}",
        f"  \\begin{{tabular}}{{{alignment}}}",
        r"    \toprule",
        f"    {' & '.join(map(escaped, grid.head))} \\\\",
        r"    \midrule",
        *(f"    {' & '.join([escaped(first), *map(written, others)])} \\\\" for first, *others in grid.rows),
        r"    \bottomrule",
        r"  \end{tabular}",
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def escaped(text: str) -> str:
    """Return a text that LaTeX prints as it is."""
    return "".join(_SPECIAL.get(sign, sign) for sign in re.sub(r"\s+", " ", text))


def _math(text: str) -> str:
    """Return a cell for LaTeX with its numbers in math mode."""
    signs = str.maketrans({"\N{MINUS SIGN}": "-", "\N{PLUS-MINUS SIGN}": r"\pm"})
    parts = enumerate(_NUMBER.split(text))
    return "".join(f"${part.translate(signs)}$" if at % 2 else escaped(part) for at, part in parts)


def _pair(names: Mapping[str, str], pair: Comparison) -> str:
    return f"{names[pair.first]} \N{MINUS SIGN} {names[pair.second]}"


def _p_of(groups: Groups, names: Sequence[str]) -> list[str]:
    return [getattr(groups, name).text for name in names]
