"""All pairs of experiments, compared at one number of real-world evaluations or over a range of them.

Each repetition is one value: its mean over the range. The paper pools the recorded fitnesses of several numbers into
one sample instead ("combining the data for more than two real-world evaluations"). Values of one repetition at several
numbers are not independent, so a pooled p is too small. The pooled tests stand beside, since the paper reports them.

Random streams have the address (seed, strategy's name, repetition, …). Two experiments of one seed and one strategy
therefore draw the same numbers in repetitions of one number, and their values may be correlated. Their pair is judged
by the paired t-test, which is valid whatever the correlation is. All other pairs are judged by Welch's t: strategies
vary unequally and baselines have more repetitions, and then Student's p, which the paper has, is wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, TypeVar

import numpy as np

from gaplab.schemas.comparison_columns import TESTS, UNPAIRED
from gaplab.schemas.comparisons import (
    Comparison,
    Groups,
    Pooled,
    Summary,
    Trusted,
)
from gaplab.services.core.arrays import FloatArray, known
from gaplab.services.core.equivalence import difference_interval, equivalent
from gaplab.services.core.intervals import improvement, summary
from gaplab.services.core.statistics import (
    UNDEFINED,
    both,
    brown_forsythe,
    compare,
    compare_paired,
    corrected,
    effect_size,
    finite,
    holm,
)

POOLED = (
    "pooled as in the paper: the values of one repetition at several numbers of evaluations are not independent, so "
    "each p is too small; trust the tests with one value for each repetition"
)

G = TypeVar("G", bound=Groups)


@dataclass(frozen=True, eq=False)
class Compared:
    """One experiment, as it is compared.

    Attributes:
        id: its id.
        name: its name.
        recorded: recorded fitness `(r, k)` by repetition and number of real-world evaluations; nan is missing.
        level: whether its only column, at 0, counts at every number of real-world evaluations.
        seed: seed of its random streams.
        strategy: name of its strategy, which is in the address of its random streams.
    """

    id: str
    name: str
    recorded: FloatArray
    level: bool
    seed: int
    strategy: str


@dataclass(frozen=True)
class Range:
    """Numbers of real-world evaluations, from `first` to `last`."""

    first: int
    last: int

    @np.errstate(over="ignore", invalid="ignore")
    def values(self, one: Compared) -> FloatArray:
        """Return the mean of each repetition over the range, `(r,)`; nan if a number of the range is missing."""
        complete = one.level or self.last < one.recorded.shape[1]
        return self._columns(one).mean(axis=1) if complete else np.full(len(one.recorded), np.nan)

    def pooled(self, one: Compared) -> FloatArray:
        """Return the values at all numbers of the range as one group."""
        return finite(self._columns(one))

    def _columns(self, one: Compared) -> FloatArray:
        return one.recorded[:, :1] if one.level else one.recorded[:, self.first : self.last + 1]


def shares_streams(one: Compared, other: Compared) -> bool:
    """Return whether repetitions of one number draw the same random numbers in both experiments."""
    return (one.seed, one.strategy) == (other.seed, other.strategy)


def compare_all(
    experiments: Sequence[Compared],
    first: int,
    last: int,
    *,
    margin: float | None = None,
    intervals: bool = True,
) -> tuple[Comparison, ...]:
    """Compare every pair of experiments; Holm's correction is over all pairs, test by test.

    Args:
        experiments: in the order of the result.
        first: first number of real-world evaluations.
        last: last number of real-world evaluations.
        margin: difference in the unit of fitness within which two experiments are equivalent; None: not tested.
        intervals: with intervals.
    """
    over = Range(first, last)
    values = {one.id: over.values(one) for one in experiments}
    summaries = {id_: summary(each, intervals=intervals) for id_, each in values.items()}
    pairs = [
        _compared(one, other, over, (summaries[one.id], summaries[other.id]), intervals=intervals)
        for one, other in combinations(experiments, 2)
    ]
    pooled = _corrected([pair.pooled for pair in pairs if pair.pooled], UNPAIRED)
    if pooled:
        pairs = [pair.model_copy(update={"pooled": each}) for pair, each in zip(pairs, pooled, strict=True)]
    pairs = _judged(_corrected(pairs, TESTS))
    return tuple(pairs) if margin is None else equivalent(pairs, values, margin)


def _compared(
    one: Compared, other: Compared, over: Range, summaries: tuple[Summary, Summary], *, intervals: bool
) -> Comparison:
    """Return the uncorrected tests of a pair."""
    first, second = over.values(one), over.values(other)
    shared = shares_streams(one, other)
    paired_t, wilcoxon = compare_paired(first, second) if shared else (UNDEFINED, UNDEFINED)
    groups = _groups(finite(first), finite(second))
    if shared:
        groups |= {"difference": _difference(*both(first, second)), "effect_size": effect_size(*both(first, second))}
    lower, upper = difference_interval(first, second, paired=shared)
    several = over.first < over.last
    pooled = Pooled(caution=POOLED, **_groups(over.pooled(one), over.pooled(other))) if several else None
    return Comparison(
        first=one.id,
        first_name=one.name,
        second=other.id,
        second_name=other.name,
        from_evaluations=over.first,
        to_evaluations=over.last,
        **groups,
        caution=f"{_streams(one, other)}; trust the paired tests" if shared else None,
        lower=lower,
        upper=upper,
        improvement=improvement(first, second, paired=shared, intervals=intervals),
        shared_streams=shared,
        streams=_streams(one, other),
        trusted=Trusted(test="paired_t" if shared else "welch"),
        n_paired=len(both(first, second)[0]) if shared else 0,
        paired_t=paired_t,
        wilcoxon=wilcoxon,
        brown_forsythe=brown_forsythe(first, second),
        summary_first=summaries[0],
        summary_second=summaries[1],
        pooled=pooled,
    )


def _groups(first: FloatArray, second: FloatArray) -> dict[str, Any]:
    student, welch, mann_whitney = compare(first, second)
    return {
        "n_first": len(first),
        "n_second": len(second),
        "difference": _difference(first, second),
        "effect_size": effect_size(first, second),
        "student": student,
        "welch": welch,
        "mann_whitney": mann_whitney,
    }


def _streams(one: Compared, other: Compared) -> str:
    """Return in words why two experiments share their random streams, or not."""
    if shares_streams(one, other):
        return (
            f"both draw the random numbers of seed {one.seed} and the strategy {one.strategy}, so repetitions of one "
            "number may be correlated"
        )
    different = ["seeds"] if one.seed != other.seed else []
    different += ["strategies"] if one.strategy != other.strategy else []
    return f"independent random numbers: different {' and '.join(different)}"


def _corrected(pairs: Sequence[G], names: Sequence[str]) -> list[G]:
    columns = zip(*(corrected([getattr(pair, name) for pair in pairs]) for name in names), strict=True)
    return [
        pair.model_copy(update=dict(zip(names, tests, strict=True))) for pair, tests in zip(pairs, columns, strict=True)
    ]


def _judged(pairs: Sequence[Comparison]) -> list[Comparison]:
    """Return pairs whose trusted tests have their p, corrected over the trusted tests of all pairs."""
    p_values: list[float | None] = [getattr(pair, pair.trusted.test).p for pair in pairs]
    return [
        pair.model_copy(update={"trusted": pair.trusted.model_copy(update={"p": p, "p_holm": p_holm})})
        for pair, p, p_holm in zip(pairs, p_values, holm(p_values), strict=True)
    ]


@np.errstate(over="ignore", invalid="ignore")
def _difference(first: FloatArray, second: FloatArray) -> float | None:
    return known(first.mean() - second.mean()) if len(first) and len(second) else None
