"""Intervals of the mean, by Student's t; of the interquartile mean and the probability of improvement, by bootstrap.

Of eight values, percentiles of resampled means hold the mean in 89 % of cases rather than 95 %, Student's t in 95 %.

Source: Agarwal et al. 2021, Deep reinforcement learning at the edge of the statistical precipice (rliable). As there,
a bootstrap interval holds 95 % of the statistic over resamples. Unlike BCa's, its ends exist for every sample.
Each interval draws its resamples from one fixed stream, so that equal values have equal intervals.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
import scipy

from gaplab.schemas.comparisons import Estimate, Summary
from gaplab.services.core.arrays import FloatArray, known
from gaplab.services.core.curves import CONFIDENCE, curve_point
from gaplab.services.core.streams import stream
from gaplab.services.findings.statistics import both, constant, finite
from gaplab.services.findings.wording import estimate

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

    Args:
        first: `(r,)` by repetition; nan is missing.
        second: `(s,)` by repetition; nan is missing.
        paired: resample repetitions, each with both of its values, instead of two independent groups.
        intervals: with the interval.
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
