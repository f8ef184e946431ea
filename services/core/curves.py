"""Curves: points computed from the recorded fitness of many repetitions."""

from functools import lru_cache
from math import isfinite

import numpy as np
from scipy import stats

from gaplab.schemas.curves import CurvePoint
from gaplab.services.core.arrays import FloatArray

CONFIDENCE = 0.95


def curve_points(recorded: FloatArray) -> tuple[CurvePoint, ...]:
    """Return one point for each number of real-world evaluations, from 0 on.

    Args:
        recorded: `(r, k)`: a row for each repetition, a column for each number of real-world evaluations. It is nan if
            the repetition has not reached it or all its measurements failed; nan counts in no statistic.
    """
    return tuple(curve_point(evaluations, column) for evaluations, column in enumerate(recorded.T))


def curve_point(evaluations: int, values: FloatArray) -> CurvePoint:
    """Return mean, sample standard deviation and 95 % interval of the mean by Student's t, over the finite values.

    A statistic is None if there are too few values, or if it overflows.

    Args:
        evaluations: number of real-world evaluations.
        values: `(r,)` by repetition.
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
        values=tuple(float(value) if np.isfinite(value) else None for value in values),
    )


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
    return float(values.std(ddof=1)) if not equal(values) else 0.0


def _interval(mean: float | None, sd: float | None, n: int) -> tuple[float | None, float | None]:
    if mean is None or sd is None:
        return None, None
    half = _quantile(n - 1) * sd / n**0.5
    return known(mean - half), known(mean + half)


def equal(values: FloatArray) -> bool:
    """Return whether all values `(n,)` are equal."""
    return bool(np.all(values == values[:1]))


def known(value: float) -> float | None:
    """Return the value, or None if it is not finite."""
    return float(value) if isfinite(value) else None


@lru_cache(maxsize=1024)
def _quantile(degrees_of_freedom: int) -> float:
    """Return the quantile of Student's t for a two-sided interval; cached, because it dominates the time of a curve."""
    return float(stats.t.ppf(0.5 + CONFIDENCE / 2, degrees_of_freedom))
