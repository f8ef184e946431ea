"""The claims that strategies differ: C4 to C7."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.reproduction import paper, statements
from benchmarks.reproduction.evidence import NO_TEST, Evidence, Examined
from benchmarks.reproduction.studies import Study
from gaplab.schemas.comparisons import Test
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.comparisons import Range
from gaplab.services.core.statistics import compare
from gaplab.services.figures.words import number_of, spoken
from gaplab.services.reports.numbers import probability, signed


@dataclass(frozen=True)
class Pair:
    """A statement that one strategy is above another.

    Attributes:
        first: the strategy that the paper has ahead.
        second: the other one.
        paper: the difference that the paper found; None if it tests none.
    """

    first: str
    second: str
    paper: paper.PaperDifference | None

    def __str__(self) -> str:
        """Return the statement in words."""
        return f"{spoken(self.first)} above {spoken(self.second).lower()}"

    @property
    def least(self) -> float:
        """Return the least difference that agrees with the paper's, as a share of direct; 0 if it gives none."""
        return self.paper.least(self.first, self.second) if self.paper else 0.0


@dataclass(frozen=True)
class Tested:
    """A pair with its values in a study.

    Attributes:
        pair: the statement.
        groups: values `(r,)` of the first and the second, one for each repetition.
        pooled: the same at all numbers of evaluations, as the paper pools them.
        unit: the mean of direct; nan for none.
    """

    pair: Pair
    groups: tuple[FloatArray, FloatArray]
    pooled: tuple[FloatArray, FloatArray]
    unit: float

    @property
    def deviation(self) -> float:
        """Return the pooled standard deviation of the values, nan if there are too few."""
        squares = sum(float(((group - group.mean()) ** 2).sum()) for group in self.groups if len(group))
        freedom = sum(map(len, self.groups)) - 2
        return float((squares / freedom) ** 0.5) if freedom > 0 else float("nan")

    @property
    def difference(self) -> float:
        """Return the difference of the means, nan without values."""
        first, second = self.groups
        return float(first.mean() - second.mean()) if len(first) and len(second) else float("nan")

    @property
    def student(self) -> Test:
        """Return the paper's test."""
        return compare(*self.pooled)[0]

    @property
    def found_by_student(self) -> bool:
        """Return whether the paper's test finds here what it found in the paper."""
        test = self.student
        if test.p is None or test.statistic is None or self.pair.paper is None:
            return False
        return test.p < self.pair.paper.p and test.statistic > 0

    def evidence(self) -> Evidence:
        """Return what speaks for and against the statement."""
        opposed = statements.above(*self.groups[::-1], 0.0, self.unit).shows
        return Evidence(str(self.pair), statements.above(*self.groups, self.pair.least, self.unit), opposed)


def one_sample_wins(study: Study) -> Examined:
    """Return the evidence that one sample of simulated fit and informative beats all others (C4a)."""
    best = paper.SIMULATED_FIT[2]
    others = [name for name in paper.STRATEGIES if name != best]
    return _examined(study, [Pair(best, other, paper.ONE_SAMPLE) for other in others], 1, 1)


def fit_strategies_lead(study: Study) -> Examined:
    """Return the evidence that strategies with simulated fit end above the others (C5a)."""
    pairs = [Pair(one, other, paper.BEYOND_TWO) for one in paper.SIMULATED_FIT for other in paper.WEAK]
    return _examined(study, pairs, 3, paper.ITERATIONS)


def fit_strategies_differ(study: Study) -> Examined:
    """Return the evidence that strategies with simulated fit differ from each other, as in the paper (C5b)."""
    plain, unique, informative = paper.SIMULATED_FIT
    pairs = [Pair(*each, paper.BEYOND_TWO) for each in ((unique, plain), (plain, informative), (unique, informative))]
    return _examined(study, pairs, 3, paper.ITERATIONS)


def known_fit_leads_random(study: Study) -> Examined:
    """Return the evidence that known fit is better than random (C5c)."""
    return _examined(study, [Pair("known_fit", "random", paper.KNOWN_FIT)], 3, paper.ITERATIONS)


def weak_strategies_differ(study: Study) -> Examined:
    """Return the evidence that strategies without simulated fit differ from each other, as in the paper (C6)."""
    informative, random, known_fit = paper.WEAK
    ordered = (informative, random), (informative, known_fit), (known_fit, random)
    return _examined(study, [Pair(*each, paper.BEYOND_FIVE) for each in ordered], 6, paper.ITERATIONS)


def uniqueness_gains(study: Study) -> Examined:
    """Return the evidence that uniqueness gains over plain simulated fit (C7)."""
    pair = Pair("simulated_fit_and_unique", "simulated_fit", None)
    return _examined(study, [pair], 3, paper.ITERATIONS)


def _examined(study: Study, pairs: Sequence[Pair], first: int, last: int) -> Examined:
    names = [name for name in paper.STRATEGIES if any(name in {pair.first, pair.second} for pair in pairs)]
    lacking = [spoken(name).lower() for name in names if not study.arm(name)]
    present = [pair for pair in pairs if study.arm(pair.first) and study.arm(pair.second)]
    reached = min(last, study.last)
    if not present:
        return Examined("", "", (), tuple(lacking))
    if reached < first:
        return Examined("", "", (), (*lacking, f"value after {number_of('sample', first)}: it ends after {reached}"))
    tested = [_tested(study, pair, first, reached) for pair in present]
    return Examined(
        here=_here(study, tested),
        paper_test=_paper_test(tested, first, reached),
        evidence=tuple(each.evidence() for each in tested),
        lacking=tuple(lacking),
        unequal=study.unequal(names),
        findable=_findable(study, tested),
    )


def _tested(study: Study, pair: Pair, first: int, last: int) -> Tested:
    arms = [arm for name in (pair.first, pair.second) if (arm := study.arm(name))]
    one, other = (Range(first, last).pooled(arm.compared()) for arm in arms)
    groups = study.values(pair.first, first, last), study.values(pair.second, first, last)
    return Tested(pair, groups, (one, other), study.unit)


def _here(study: Study, tested: Sequence[Tested]) -> str:
    """Return the smallest lead of the strategies that the paper has ahead; it may be negative."""
    known = [each for each in tested if np.isfinite(each.difference)]
    if not known:
        return ""
    one = min(known, key=lambda each: each.difference)
    whose, unit = ("", 1.0) if np.isnan(study.unit) else (" of direct", study.unit)
    least = "difference" if len(known) == 1 else "least difference"
    return f"{least} {signed(one.difference / unit)}{whose} ({one.pair})"


def _paper_test(tested: Sequence[Tested], first: int, last: int) -> str:
    limits = sorted({each.pair.paper.p for each in tested if each.pair.paper})
    if not limits:
        return NO_TEST
    where = f"at {number_of('sample', first)}" if first == last else f"pooled over {first} to {last} samples"
    found = sum(each.found_by_student for each in tested)
    below = " or ".join(f"{limit:g}" for limit in limits)
    p_values = [(each.student.p, each.pair) for each in tested if each.student.p is not None]
    largest = max(p_values, key=lambda each: each[0], default=None)
    told = f"; largest p {probability(largest[0])} ({largest[1]})" if largest else ""
    return f"Student {where}: {found} of {number_of('pair', len(tested))} with p < {below}{told}"


def _findable(study: Study, tested: Sequence[Tested]) -> str:
    """Return in a sentence what the study could find, and how many repetitions the paper's differences need."""
    counted = [each for each in tested if min(map(len, each.groups)) > 1 and each.deviation and each.pair.paper]
    if not counted or np.isnan(study.unit):
        return ""
    needed = [statements.repetitions_needed(each.pair.least * study.unit / each.deviation) for each in counted]
    one = counted[int(np.argmax(needed))]
    sizes = len(one.groups[0]), len(one.groups[1])
    difference = statements.smallest_found(one.deviation, sizes) / study.unit
    return (
        f"With {' and '.join(map(str, sizes))} repetitions, a true difference of {difference:.2f} of direct is found "
        f"in {statements.POWER:.0%} of studies ({one.pair}). The least that agrees with the paper is "
        f"{one.pair.least:.3f}: finding it in this pair takes {number_of('repetition', max(needed))}."
    )
