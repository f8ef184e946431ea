"""The points of a curve, from the recorded fitness of many repetitions."""

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
        recorded: `(r, k)`, by repetition and real-world evaluations; nan where a repetition has not got there or all
            of its measurements failed. No statistic counts such a value.
    """
    return tuple(curve_point(evaluations, column) for evaluations, column in enumerate(recorded.T))


@np.errstate(over="ignore", invalid="ignore")
def curve_point(evaluations: int, values: FloatArray) -> CurvePoint:
    """Return mean, sample standard deviation and 95 % interval of the mean by Student's t, over the finite values.

    A statistic is None if it overflows, or if there are too few values.

    Args:
        evaluations: number of real-world evaluations.
        values: `(r,)` by repetition.
    """
    there = values[np.isfinite(values)]
    n = len(there)
    mean = known(there.mean()) if n else None
    sd = known(_deviation(there)) if n > 1 else None
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


def _deviation(values: FloatArray) -> float:
    """Return the sample standard deviation; exactly 0 for equal values, although their mean may be rounded."""
    return float(values.std(ddof=1)) if not equal(values) else 0.0


def _interval(mean: float | None, sd: float | None, n: int) -> tuple[float | None, float | None]:
    if mean is None or sd is None:
        return None, None
    half = _quantile(n - 1) * sd / n**0.5
    return known(mean - half), known(mean + half)


def equal(values: FloatArray) -> bool:
    """Return whether all values `(n,)` are the same."""
    return bool(np.all(values == values[:1]))


def known(value: float) -> float | None:
    """Return the value, or None if it is not finite."""
    return float(value) if isfinite(value) else None


@lru_cache(maxsize=1024)
def _quantile(degrees_of_freedom: int) -> float:
    """Return the two-sided quantile of Student's t. The cache matters: it takes longer than the rest of a curve."""
    return float(stats.t.ppf(0.5 + CONFIDENCE / 2, degrees_of_freedom))
