"""Tests of single statements: each returns the p-values that support it and refute it.

The first is p of the hypothesis that the statement does not hold, the second p of the hypothesis that it holds in the
least size that the paper implies. They are None for fewer than `FEWEST_REPETITIONS` values, or if nothing varies.
"""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from scipy import stats

from gaplab.schemas.comparisons import Test
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.equivalence import difference_interval, equivalence_p
from gaplab.services.core.statistics import compare, compare_paired
from gaplab.services.core.streams import stream
from gaplab.services.core.trends import FEWEST_REPETITIONS

SIGNIFICANT = 0.05
POWER = 0.8
RESAMPLES = 2_000

PValues: TypeAlias = tuple[float | None, float | None]
"""p-values that support and refute a statement."""

UNKNOWN: PValues = (None, None)


def above(first: FloatArray, second: FloatArray, least: float = 0.0) -> PValues:
    """Test a mean above another one.

    Args:
        first: `(n,)`.
        second: `(m,)`.
        least: the difference, in the unit of the values, whose absence refutes the statement.
    """
    if min(len(first), len(second)) < FEWEST_REPETITIONS:
        return UNKNOWN
    student, welch, _ = compare(first, second)
    against = compare(first - least, second)[1]
    return _larger(_greater(student), _greater(welch)), _less(against)


def apart(first: FloatArray, second: FloatArray, least: float = 0.0) -> PValues:
    """Test a difference of two means, either way; refuted if it is shown to be below `least`, unless that is 0."""
    if min(len(first), len(second)) < FEWEST_REPETITIONS:
        return UNKNOWN
    student, welch, _ = compare(first, second)
    return _larger(student.p, welch.p), equivalence_p(first, second, least, paired=False) if least else None


def alike(first: FloatArray, second: FloatArray, margin: float) -> PValues:
    """Test that two means are within a margin of each other."""
    if min(len(first), len(second)) < FEWEST_REPETITIONS:
        return UNKNOWN
    ends = _greater(compare(first - margin, second)[1]), _less(compare(first + margin, second)[1])
    known = [p for p in ends if p is not None]
    return equivalence_p(first, second, margin, paired=False), min(known, default=None)


def rising(gains: FloatArray, least: float = 0.0) -> PValues:
    """Test a mean gain above 0, one gain `(r,)` for each repetition; refuted if it is shown to be below `least`."""
    if len(gains) < FEWEST_REPETITIONS:
        return UNKNOWN
    zeros = np.zeros_like(gains)
    return _greater(compare_paired(gains, zeros)[0]), _less(compare_paired(gains - least, zeros)[0])


def narrower(narrow: Sequence[FloatArray], wide: Sequence[FloatArray], threshold: float) -> tuple[float, PValues]:
    """Return the ratio of two standard deviations, and the test that it is below a threshold.

    A standard deviation is the root of the mean variance over groups and numbers of evaluations. The p-values are
    shares of resamples of whole repetitions, two-sided.

    Args:
        narrow: groups `(r, k)` by repetition and number of evaluations.
        wide: the same, of the denominator.
        threshold: of the ratio.
    """
    rng = stream(0, "standard deviations")
    with np.errstate(all="ignore"):
        ratio = float(np.sqrt(_variance(narrow) / _variance(wide)))
        ratios = np.sqrt(_resampled(narrow, rng) / _resampled(wide, rng))
    if min(map(len, [*narrow, *wide])) < FEWEST_REPETITIONS or not np.isfinite(ratios).all():
        return ratio, UNKNOWN
    return ratio, (_share(ratios >= threshold), _share(ratios <= threshold))


def _variance(groups: Sequence[FloatArray]) -> float:
    return float(np.mean([group.var(axis=0, ddof=1).mean() for group in groups]))


def _resampled(groups: Sequence[FloatArray], rng: np.random.Generator) -> FloatArray:
    """Return the mean variance of each resample, `(RESAMPLES,)`."""
    found = np.zeros(RESAMPLES)
    for group in groups:
        drawn = group[rng.integers(len(group), size=(RESAMPLES, len(group)))]
        found += drawn.var(axis=1, ddof=1).mean(axis=1) / len(groups)
    return found


def _share(resamples: np.ndarray[Any, np.dtype[np.bool_]]) -> float:
    return float(min(1.0, 2 * (1 + resamples.sum()) / (len(resamples) + 1)))


def findable(deviation: float, n: tuple[int, int]) -> float:
    """Return the difference of two means that a two-sided test finds with the power `POWER`."""
    freedom = max(1, sum(n) - 2)
    quantiles = stats.t.ppf(1 - SIGNIFICANT / 2, freedom) + stats.t.ppf(POWER, freedom)
    return float(quantiles * deviation * (1 / n[0] + 1 / n[1]) ** 0.5)


def needed(effect: float) -> int:
    """Return the repetitions that find a difference of so many standard deviations with the power `POWER`."""
    quantiles = stats.norm.ppf(1 - SIGNIFICANT / 2) + stats.norm.ppf(POWER)
    return int(np.ceil(2 * (quantiles / effect) ** 2))


def estimate(first: FloatArray, second: FloatArray, unit: float, *, paired: bool = False, base: float = 0.0) -> str:
    """Return a difference of means in a unit, with its 90 % interval, in words.

    Args:
        first: `(n,)`.
        second: `(m,)`; what is subtracted.
        unit: the mean of direct; nan for none.
        paired: whether the values of one repetition belong together.
        base: added to the difference: 1 for a ratio to direct.
    """
    if not len(first) or not len(second):
        return ""
    scale = 1.0 if np.isnan(unit) else unit
    ends = difference_interval(first, second, paired=paired)
    form = ".2f" if base else "+.3f"
    value, *known = (
        f"{base + end / scale:{form}}" for end in (float(first.mean() - second.mean()), *ends) if end is not None
    )
    told = f"{value} ({' to '.join(known)})" if known else value
    return told.replace("-", "\N{MINUS SIGN}")


def _greater(test: Test) -> float | None:
    """Return p of the hypothesis that a difference is not above 0: two-sided, or 1 if it is not."""
    if test.p is None or test.statistic is None:
        return None
    return test.p if test.statistic > 0 else 1.0


def _less(test: Test) -> float | None:
    if test.p is None or test.statistic is None:
        return None
    return test.p if test.statistic < 0 else 1.0


def _larger(first: float | None, second: float | None) -> float | None:
    return None if first is None or second is None else max(first, second)
