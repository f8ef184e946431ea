"""Tests of means, ranks and spreads of two groups, Holm's correction over many pairs, and intervals.

A test is undefined, with None as its numbers, if there are fewer than two values, if nothing varies, or if squares of
values overflow.

Intervals of a mean are Student's; those of the interquartile mean and of the probability of improvement are by
bootstrap. Of eight values, percentiles of resampled means hold the mean in 89 % of cases, Student's t in 95 %. A
bootstrap interval holds 95 % of the statistic over resamples; unlike BCa's, its ends exist for every sample. Each draws
its resamples from one fixed stream, so that equal values have equal intervals.

Source of intervals: Agarwal et al. 2021, Deep reinforcement learning at the edge of the statistical precipice
(rliable).
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from math import inf, isfinite
from typing import Any

import numpy as np
import scipy

from gaplab.schemas.comparisons import Estimate, Summary, Test
from gaplab.services.core.arrays import FloatArray, known
from gaplab.services.core.curves import CONFIDENCE, curve_point
from gaplab.services.core.streams import stream
from gaplab.services.findings.wording import estimate, probabilities

SIGNIFICANT = 0.05
"""Level below which a corrected p says that two groups differ, or are equivalent."""

ROUNDING = 1e-12
"""Variation, relative to the largest value, that counts as rounding."""

UNDEFINED = Test()


@np.errstate(over="ignore", invalid="ignore")
def compare(first: FloatArray, second: FloatArray) -> tuple[Test, Test, Test]:
    """Return Student's t (as the paper), Welch's t and Mann-Whitney of `(n,)` and `(m,)`, two-sided; nan is ignored."""
    first, second = finite(first), finite(second)
    if min(len(first), len(second)) < 2 or constant(np.concatenate([first, second])):
        return UNDEFINED, UNDEFINED, UNDEFINED
    ranks = _test(scipy.stats.mannwhitneyu(first, second))
    if not varies(first, second):
        return UNDEFINED, UNDEFINED, ranks
    first, second = moved(first, second)
    student = scipy.stats.ttest_ind(first, second)
    welch = scipy.stats.ttest_ind(first, second, equal_var=False)
    return _test(student, student.df), _test(welch, welch.df), ranks


@np.errstate(over="ignore", invalid="ignore")
def compare_paired(first: FloatArray, second: FloatArray) -> tuple[Test, Test]:
    """Return the paired t-test and Wilcoxon's of `(r,)` and `(s,)` by repetition, two-sided; nan is missing."""
    first, second = both(first, second)
    difference = first - second
    if len(difference) < 2 or not difference.any():
        return UNDEFINED, UNDEFINED
    ranks = _test(scipy.stats.wilcoxon(difference))
    if constant_difference(first, second):
        return UNDEFINED, ranks
    paired = scipy.stats.ttest_1samp(difference, 0.0)
    return _test(paired, paired.df), ranks


@np.errstate(all="ignore")
def brown_forsythe(first: FloatArray, second: FloatArray) -> Test:
    """Return Brown and Forsythe's test of equal spread, which is Levene's with the median, between two groups.

    It is also undefined if the distances from the median do not vary within a group, as those of two values. Arguments
    are as of `compare`.
    """
    groups = [finite(first), finite(second)]
    if min(map(len, groups)) < 2 or all(constant(np.abs(each - np.median(each)), each) for each in groups):
        return UNDEFINED
    return _test(scipy.stats.levene(*groups, center="median"))


@np.errstate(over="ignore", invalid="ignore")
def effect_size(first: FloatArray, second: FloatArray) -> float | None:
    """Return Cohen's d of groups `(n,)` and `(m,)`: difference of the means over the pooled standard deviation.

    None if that deviation is 0 or unknown. Numbers that are not finite do not count.
    """
    first, second = finite(first), finite(second)
    freedom = len(first) + len(second) - 2
    if min(len(first), len(second)) < 2 or (constant(first) and constant(second)):
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


def corrected(family: Sequence[Test]) -> tuple[Test, ...]:
    """Return the tests of a family with Holm's corrected p."""
    p_values = holm([test.p for test in family])
    told = [{"p_holm": p, "text": probabilities(test.p, p)} for test, p in zip(family, p_values, strict=True)]
    return tuple(test.model_copy(update=each) for test, each in zip(family, told, strict=True))


def finite(values: FloatArray) -> FloatArray:
    """Return the finite values as one vector."""
    return values[np.isfinite(values)]


@np.errstate(over="ignore", invalid="ignore")
def both(first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the values `(n,)` of two experiments at the repetition numbers that have a finite value in both."""
    common = min(len(first), len(second))
    first, second = first[:common], second[:common]
    there = np.isfinite(first - second)
    return first[there], second[there]


@np.errstate(over="ignore")
def constant(values: FloatArray, scale: FloatArray | None = None) -> bool:
    """Return whether values `(n,)`, one or more, are equal up to the rounding of the numbers `scale`."""
    largest = np.max(np.abs(values if scale is None else scale))
    return bool(values.max() - values.min() <= ROUNDING * largest)


def constant_difference(first: FloatArray, second: FloatArray) -> bool:
    """Return whether paired values `(n,)` differ by one number, up to rounding."""
    return constant(first - second, np.concatenate([first, second]))


def varies(first: FloatArray, second: FloatArray, shift: float = 0.0) -> bool:
    """Return whether values of a group, `(n,)` or `(m,)`, differ by more than the rounding of `moved` groups."""
    scale = _scale(first, second, shift)
    return not (constant(first, scale) and constant(second, scale))


def moved(first: FloatArray, second: FloatArray, shift: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Return groups `(n,)` and `(m,)` whose means differ by `shift` more; a constant group becomes 0.

    The variance of equal numbers may differ from 0 by rounding. That of zeros is 0. A group counts as constant if its
    variation is below the rounding of the largest number that is added or subtracted.
    """
    scale = _scale(first, second, shift)
    if constant(second, scale):
        return first - second[0] + shift, np.zeros_like(second)
    if constant(first, scale):
        return np.zeros_like(first), second - first[0] - shift
    return first + shift, second


def _scale(first: FloatArray, second: FloatArray, shift: float) -> FloatArray:
    return np.concatenate([first, second, [shift]])


def _test(result: object, freedom: float | None = None) -> Test:
    statistic, p = known(result.statistic), known(result.pvalue)  # type: ignore[attr-defined] # scipy has no stubs
    if statistic is None or p is None or not (freedom is None or isfinite(freedom)):
        return UNDEFINED
    return Test(statistic=statistic, p=p, degrees_of_freedom=None if freedom is None else float(freedom))


RESAMPLES = 2_000
MOST_PAIRS_OF_VALUES = 1_000_000
"""Largest product of two groups' sizes for which the probability of improvement has an interval."""

_MIDDLE = 0.25
_KEPT = 4_096
_DRAWN_AT_ONCE = 1_000_000

Ends = tuple[float | None, float | None]


def summary(values: FloatArray, *, intervals: bool) -> Summary:
    """Return mean, interquartile mean and standard deviation of an experiment's values `(r,)`; nan is ignored."""
    there = finite(values)
    point = curve_point(0, there)
    middle = known(_interquartile_mean(there)) if len(there) else None
    unequal = intervals and len(there) > 1 and not constant(there)
    of_mean = (point.lower, point.upper) if unequal else (None, None)
    of_middle = _ends_of_middle(there.tobytes()) if unequal else (None, None)
    return Summary(
        n=point.n, sd=point.sd, mean=_estimate(point.mean, of_mean), interquartile_mean=_estimate(middle, of_middle)
    )


def improvement(first: FloatArray, second: FloatArray, *, paired: bool, intervals: bool) -> Estimate:
    """Return the probability that a value of the first is greater than one of the second; a tie counts half.

    Values `(r,)` and `(s,)` are by repetition; nan is missing. If paired, its interval resamples repetitions, each with
    both of its values, instead of two independent groups.
    """
    first, second = both(first, second) if paired else (finite(first), finite(second))
    pairs = len(first) * len(second)
    if not pairs:
        return _estimate(None, (None, None))
    share = float(scipy.stats.mannwhitneyu(first, second, method="asymptotic").statistic) / pairs
    if not intervals or pairs > MOST_PAIRS_OF_VALUES:
        return _estimate(share, (None, None))
    return _estimate(share, _ends_of_improvement(first.tobytes(), second.tobytes(), paired))


@lru_cache(maxsize=_KEPT)
def _ends_of_middle(values: bytes) -> Ends:
    return _ends((np.frombuffer(values),), _interquartile_mean)


@lru_cache(maxsize=_KEPT)
def _ends_of_improvement(first: bytes, second: bytes, paired: bool) -> Ends:
    groups = np.frombuffer(first), np.frombuffer(second)
    if min(map(len, groups)) < 2:
        return None, None
    above = (np.sign(np.subtract.outer(*groups)) + 1) / 2

    def share(rows: Any, columns: Any, axis: int) -> Any:  # noqa: ANN401, ARG001 - scipy passes the axis, the last
        """Return the mean of `above` over resampled rows and columns, by how often each was drawn."""
        rows, columns = np.atleast_2d(rows), np.atleast_2d(columns)
        drawn = _counts(rows, len(above)) @ above
        return (drawn * _counts(columns, above.shape[1])).sum(axis=-1) / (rows.shape[1] * columns.shape[1])

    return _ends(tuple(np.arange(len(group)) for group in groups), share, paired=paired)


@np.errstate(over="ignore", invalid="ignore")
def _ends(data: tuple[Any, ...], statistic: Callable[..., Any], *, paired: bool = False) -> Ends:
    """Return the ends of an interval; None if they overflow, or if all resamples agree."""
    found = scipy.stats.bootstrap(
        data,
        statistic,
        n_resamples=RESAMPLES,
        batch=max(1, _DRAWN_AT_ONCE // max(map(len, data))),
        vectorized=True,
        paired=paired,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=stream(0, "bootstrap"),
    ).confidence_interval
    lower, upper = known(found.low), known(found.high)
    return (None, None) if lower is None or upper is None or lower == upper else (lower, upper)


def _interquartile_mean(values: FloatArray, axis: int = -1) -> Any:  # noqa: ANN401 - one number, or one by resample
    return scipy.stats.trim_mean(values, _MIDDLE, axis=axis)


def _counts(drawn: Any, n: int) -> FloatArray:  # noqa: ANN401 - whole numbers
    """Return how often each of n indices stands in each row of `(b, k)`: `(b, n)`."""
    cells = drawn + n * np.arange(len(drawn))[:, None]
    return np.bincount(cells.ravel(), minlength=n * len(drawn)).reshape(-1, n).astype(float)


def _estimate(value: float | None, ends: Ends) -> Estimate:
    return Estimate(value=value, lower=ends[0], upper=ends[1], text=estimate(value, *ends))
