"""The paper's t-tests between experiments, with Welch's and Mann-Whitney's tests and Holm's correction.

The paper pools the recorded fitnesses of several counts of real-world evaluations into one sample ("combining the data
for more than two real-world evaluations"). Values of one repetition at several counts are not independent, so a pooled
p is too small. It is reported because the paper reports it, and is reliable only at a single count.
"""

from collections.abc import Sequence
from itertools import combinations
from math import inf, isfinite

import numpy as np
from scipy import stats

from gaplab.schemas.curves import Comparison, Test
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.curves import equal, known

POOLED = (
    "pooled as in the paper: the values of one repetition at several numbers of evaluations are not independent, so "
    "each p is too small; trust a single number"
)


@np.errstate(over="ignore", invalid="ignore")
def compare(first: FloatArray, second: FloatArray) -> tuple[Test, Test, Test]:
    """Return Student's t (the paper's), Welch's t and Mann-Whitney between two groups, two-sided.

    A test is undefined, with None as its numbers, if a group has fewer than two values, if neither group varies, or if
    squares of values overflow.

    Args:
        first: `(n,)`; nan is ignored.
        second: `(m,)`; nan is ignored.
    """
    first, second = finite(first), finite(second)
    if min(len(first), len(second)) < 2 or equal(np.concatenate([first, second])):
        undefined = Test(statistic=None, p=None)
        return undefined, undefined, undefined
    if equal(first) and equal(second):
        undefined = Test(statistic=None, p=None)
        return undefined, undefined, _test(stats.mannwhitneyu(first, second))
    student = stats.ttest_ind(first, second)
    welch = stats.ttest_ind(first, second, equal_var=False)
    return _test(student, student.df), _test(welch, welch.df), _test(stats.mannwhitneyu(first, second))


@np.errstate(over="ignore", invalid="ignore")
def effect_size(first: FloatArray, second: FloatArray) -> float | None:
    """Return Cohen's d: difference of the means over the pooled standard deviation; None if that is 0 or unknown."""
    first, second = finite(first), finite(second)
    freedom = len(first) + len(second) - 2
    if min(len(first), len(second)) < 2 or (equal(first) and equal(second)):
        return None  # the computed variance of equal numbers may differ from 0
    pooled = ((len(first) - 1) * first.var(ddof=1) + (len(second) - 1) * second.var(ddof=1)) / freedom
    return known((first.mean() - second.mean()) / pooled**0.5) if 0 < pooled < inf else None


def holm(p_values: Sequence[float | None]) -> tuple[float | None, ...]:
    """Return p-values with Holm's step-down correction over a family of tests, without undefined tests.

    Source: Holm 1979, A simple sequentially rejective multiple test procedure.
    """
    defined = sorted((p, index) for index, p in enumerate(p_values) if p is not None)
    corrected: list[float | None] = [None] * len(p_values)
    running = 0.0
    for rank, (p, index) in enumerate(defined):
        running = max(running, min(1.0, p * (len(defined) - rank)))
        corrected[index] = running
    return tuple(corrected)


def compare_all(
    recorded: dict[str, FloatArray], levels: frozenset[str], from_evaluations: int, to_evaluations: int
) -> tuple[Comparison, ...]:
    """Compare every pair of experiments, pooled over a range of counts; Holm's correction is over all pairs, by test.

    Args:
        recorded: recorded fitness `(r, k)` by experiment, in the order of the result.
        levels: experiments whose only column, at 0, counts at every number of real-world evaluations.
        from_evaluations: first pooled count.
        to_evaluations: last pooled count.
    """
    pooled = {
        name: finite(values[:, :1] if name in levels else values[:, from_evaluations : to_evaluations + 1])
        for name, values in recorded.items()
    }
    pairs = list(combinations(pooled, 2))
    families = [corrected(family) for family in zip(*(compare(pooled[a], pooled[b]) for a, b in pairs), strict=True)]
    return tuple(
        Comparison(
            first=first,
            second=second,
            from_evaluations=from_evaluations,
            to_evaluations=to_evaluations,
            caution=POOLED if from_evaluations < to_evaluations else None,
            n_first=len(pooled[first]),
            n_second=len(pooled[second]),
            difference=_difference(pooled[first], pooled[second]),
            effect_size=effect_size(pooled[first], pooled[second]),
            student=student,
            welch=welch,
            mann_whitney=mann_whitney,
        )
        for (first, second), student, welch, mann_whitney in zip(pairs, *families, strict=True)
    )


def corrected(family: Sequence[Test]) -> tuple[Test, ...]:
    """Return the tests of a family with Holm's corrected p."""
    p_values = holm([test.p for test in family])
    return tuple(test.model_copy(update={"p_holm": p}) for test, p in zip(family, p_values, strict=True))


def finite(values: FloatArray) -> FloatArray:
    """Return the finite values as one vector."""
    return values[np.isfinite(values)]


@np.errstate(over="ignore", invalid="ignore")
def _difference(first: FloatArray, second: FloatArray) -> float | None:
    return known(first.mean() - second.mean()) if len(first) and len(second) else None


def _test(result: object, freedom: float | None = None) -> Test:
    statistic, p = known(result.statistic), known(result.pvalue)  # type: ignore[attr-defined] # scipy has no stubs
    if statistic is None or p is None or not (freedom is None or isfinite(freedom)):
        return Test(statistic=None, p=None)
    return Test(statistic=statistic, p=p, degrees_of_freedom=None if freedom is None else float(freedom))
