"""The claims that strategies differ: C4 to C7."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from benchmarks.reproduction import paper, statements
from benchmarks.reproduction.evidence import Evidence, Examined
from benchmarks.reproduction.studies import Study
from gaplab.schemas.comparisons import Test
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.comparisons import Range
from gaplab.services.core.statistics import compare
from gaplab.services.figures.words import number_of, spoken
from gaplab.services.reports.numbers import probability, signed


@dataclass(frozen=True)
class Pair:
    """A statement on two strategies.

    Attributes:
        first: a strategy.
        second: another one.
        paper: the difference that the paper found.
        ahead: whether the paper has the first above the second, and not only different.
    """

    first: str
    second: str
    paper: paper.Difference
    ahead: bool = True

    def __str__(self) -> str:
        """Return the statement in words."""
        relation = "above" if self.ahead else "differs from"
        return f"{spoken(self.first)} {relation} {spoken(self.second).lower()}"

    @property
    def least(self) -> float:
        """Return the least difference that agrees with the paper's, as a share of direct."""
        return self.paper.least(self.first, self.second)


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
        if test.p is None or test.statistic is None:
            return False
        return test.p < self.pair.paper.p and (test.statistic > 0 or not self.pair.ahead)

    def evidence(self) -> Evidence:
        """Return what speaks for and against the statement."""
        least = 0.0 if np.isnan(self.unit) else self.pair.least * self.unit
        test = statements.above if self.pair.ahead else statements.apart
        opposed = statements.above(*self.groups[::-1])[0] if self.pair.ahead else None
        told = statements.estimate(*self.groups, self.unit)
        return Evidence(str(self.pair), *test(*self.groups, least), told, opposed)


def one_sample_wins(study: Study) -> Examined:
    """Examine C4."""
    best = paper.SIMULATED_FIT[2]
    others = [name for name in paper.STRATEGIES if name != best]
    return _examined(study, [Pair(best, other, paper.ONE_SAMPLE) for other in others], 1, 1)


def fit_strategies_lead(study: Study) -> Examined:
    """Examine C5a."""
    pairs = [Pair(one, other, paper.BEYOND_TWO) for one in paper.SIMULATED_FIT for other in paper.WEAK]
    return _examined(study, pairs, 3, paper.ITERATIONS)


def fit_strategies_differ(study: Study) -> Examined:
    """Examine C5b."""
    pairs = [Pair(one, other, paper.BEYOND_TWO, ahead=False) for one, other in combinations(paper.SIMULATED_FIT, 2)]
    return _examined(study, pairs, 3, paper.ITERATIONS)


def known_fit_leads_random(study: Study) -> Examined:
    """Examine C5c."""
    return _examined(study, [Pair("known_fit", "random", paper.KNOWN_FIT)], 3, paper.ITERATIONS)


def weak_strategies_differ(study: Study) -> Examined:
    """Examine C6."""
    pairs = [Pair(one, other, paper.BEYOND_FIVE, ahead=False) for one, other in combinations(paper.WEAK, 2)]
    return _examined(study, pairs, 6, paper.ITERATIONS)


def uniqueness_gains(study: Study) -> Examined:
    """Examine C7."""
    pair = Pair("simulated_fit_and_unique", "simulated_fit", paper.BEYOND_TWO)
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
    """Return the differences of the means, the smallest first for those that the paper has ahead."""
    ranked = sorted(tested, key=lambda each: each.difference if each.pair.ahead else abs(each.difference))
    unit = 1.0 if np.isnan(study.unit) else study.unit
    told = signed(ranked[0].difference / unit)
    whose = "" if np.isnan(study.unit) else " of direct"
    least = "difference" if len(ranked) == 1 else "least difference"
    return f"{least} {told}{whose} ({ranked[0].pair})"


def _paper_test(tested: Sequence[Tested], first: int, last: int) -> str:
    where = f"at {number_of('sample', first)}" if first == last else f"pooled over {first} to {last} samples"
    found = sum(each.found_by_student for each in tested)
    limits = sorted({each.pair.paper.p for each in tested})
    below = " or ".join(f"{limit:g}" for limit in limits)
    p_values = [(each.student.p, each.pair) for each in tested if each.student.p is not None]
    largest = max(p_values, key=lambda each: each[0], default=None)
    told = f"; largest p {probability(largest[0])} ({largest[1]})" if largest else ""
    return f"Student {where}: {found} of {number_of('pair', len(tested))} with p < {below}{told}"


def _findable(study: Study, tested: Sequence[Tested]) -> str:
    """Return in a sentence what the study could find, and how many repetitions the paper's difference needs."""
    counted = [each for each in tested if min(map(len, each.groups)) > 1]
    if not counted or np.isnan(study.unit):
        return ""
    differences = [
        statements.findable(each.deviation, (len(each.groups[0]), len(each.groups[1]))) / study.unit for each in counted
    ]
    widest = int(np.argmax(differences))
    one = counted[widest]
    needed = statements.needed(one.pair.least * study.unit / one.deviation) if one.deviation else 2
    return (
        f"With {' and '.join(map(str, map(len, one.groups)))} repetitions it finds a difference of "
        f"{differences[widest]:.2f} of direct. The least that agrees with the paper is {one.pair.least:.2f}: finding "
        f"it takes {number_of('repetition', needed)}."
    )
