"""Curves: points computed from the recorded fitness of many repetitions."""

from functools import lru_cache

import numpy as np
import scipy

from gaplab.schemas.curves import CurvePoint
from gaplab.services.core.arrays import FloatArray, known

CONFIDENCE = 0.95

FEWEST_SEARCHES = 20
"""Least number of direct searches for an estimate of the best of several."""

MOST_SEARCHES = 1_001
"""Searches of which the best is estimated: one more than the iterations that a spec may have."""


def curve_points(recorded: FloatArray) -> tuple[CurvePoint, ...]:
    """Return one point for each number of real-world evaluations, from 0 on.

    Args:
        recorded: `(r, k)`: a row for each repetition, a column for each number of real-world evaluations. It is nan if
            the repetition has not reached it or all its measurements failed; nan counts in no statistic.
    """
    return tuple(curve_point(evaluations, column) for evaluations, column in enumerate(recorded.T))


def curve_point(evaluations: int, values: FloatArray) -> CurvePoint:
    """Return mean, sample standard deviation and 95 % interval of the mean by Student's t, over the finite values.

    Values are `(r,)`, by repetition. A statistic is None if there are too few, or if it overflows.
    """
    n, mean, sd = mean_and_deviation(values)
    lower, upper = _interval(mean, sd, n)
    return CurvePoint(
        evaluations=evaluations,
        n=n,
        mean=mean,
        sd=sd,
        lower=lower,
        upper=upper,
        values=tuple(map(known, values)),
    )


@np.errstate(over="ignore", invalid="ignore")
def best_of_searches(values: FloatArray) -> tuple[float | None, ...]:
    """Return the expected largest fitness of 1, 2, 3 … direct searches, up to half of all; empty for fewer than 20.

    Each is the mean of the largest over all choices of so many searches. So it is an unbiased estimate for new,
    independent searches, whatever their distribution. None if it overflows. Values `(r,)` are what each reached; nan is
    left out.
    """
    largest_first = np.sort(values[np.isfinite(values)])[::-1]
    n = len(largest_first)
    sizes = range(1, min(n // 2, MOST_SEARCHES) + 1) if n >= FEWEST_SEARCHES else ()
    return tuple(known(float(largest_first @ _chances(n, size))) for size in sizes)


def _chances(n: int, size: int) -> FloatArray:
    """Return the probability `(n,)` of each of n values, the largest first, to be the largest of `size` of them."""
    smaller = np.arange(n - 1, 0, -1)
    return size / n * np.concatenate([[1.0], np.cumprod((smaller - size + 1) / smaller)])


@np.errstate(over="ignore", invalid="ignore")
def mean_and_deviation(values: FloatArray) -> tuple[int, float | None, float | None]:
    """Return the number of finite values `(r,)`, their mean and their sample standard deviation.

    A statistic is None if there are too few values, or if it overflows.
    """
    there = values[np.isfinite(values)]
    n = len(there)
    return n, known(there.mean()) if n else None, known(_deviation(there)) if n > 1 else None


def _deviation(values: FloatArray) -> float:
    """Return the standard deviation; exactly 0 for equal values, whose mean may be rounded."""
    return 0.0 if np.all(values == values[:1]) else float(values.std(ddof=1))


def _interval(mean: float | None, sd: float | None, n: int) -> tuple[float | None, float | None]:
    if mean is None or sd is None:
        return None, None
    half = _quantile(n - 1) * sd / n**0.5
    return known(mean - half), known(mean + half)


@lru_cache(maxsize=1024)
def _quantile(degrees_of_freedom: int) -> float:
    """Return the quantile of Student's t for a two-sided interval; cached, because it dominates the time of a curve."""
    return float(scipy.special.stdtrit(degrees_of_freedom, 0.5 + CONFIDENCE / 2))
