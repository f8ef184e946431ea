"""Tests of single statements: each returns the p-values that show it and refute it, and its estimate in words.

The first is p of the hypothesis that the statement does not hold, the second p of the hypothesis that it holds in the
least size that the paper implies. All are two-sided: a p of 0.05 is one of 0.025 on one side. They are None for fewer
than `FEWEST_REPETITIONS` values, or if nothing varies. Tests and intervals are by Welch's t, so an interval has 0 or
the size within it exactly if the p is above 0.05.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from scipy import stats

from benchmarks.differences import Difference
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.equivalence import SIGNIFICANT
from gaplab.services.core.streams import stream
from gaplab.services.core.trends import FEWEST_REPETITIONS

CONFIDENCE = 1 - SIGNIFICANT
POWER = 0.8

Test: TypeAlias = Callable[[Difference], tuple[float, float | None]]
"""Returns p that shows a statement on a difference, and p that refutes it."""


class Tested(NamedTuple):
    """A tested statement.

    Attributes:
        shows: p of the hypothesis that it does not hold; None if undefined.
        refutes: p of the hypothesis that it holds in the size that refutes the claim; None if undefined.
        estimate: the estimate with its 95 % interval, in words.
        smaller: p of the hypothesis that it holds in the paper's size; None if `refutes` is that, or undefined.
    """

    shows: float | None
    refutes: float | None
    estimate: str
    smaller: float | None = None


def above(first: FloatArray, second: FloatArray, least: float, unit: float) -> Tested:
    """Test a mean above another one.

    Args:
        first: `(n,)`.
        second: `(m,)`.
        least: the difference, as a share of direct, whose absence refutes the statement.
        unit: the mean of direct; nan for none.
    """
    found = _over(Difference.unpaired(first, second), unit)
    return _tested(found, (first, second), lambda one: (one.above(0.0), one.below(_size(least, unit))))


def differ(first: FloatArray, second: FloatArray) -> float | None:
    """Return p of a difference of two means, `(n,)` and `(m,)`, either way; None if undefined."""
    found = Difference.unpaired(first, second)
    return _tested(found, (first, second), lambda one: (one.p, None)).shows


def rises(gains: FloatArray, least: float, unit: float) -> Tested:
    """Test a mean gain above 0, one gain `(r,)` for each repetition; refuted if it is shown to be below `least`."""
    found = _over(Difference.mean(gains), unit)
    return _tested(found, (gains,), lambda one: (one.above(0.0), one.below(_size(least, unit))))


RESAMPLES = 20_000
"""Resamples of the ratio of standard deviations; with 2 000, its p near 0.04 varies by 0.006."""


def reaches(values: FloatArray, direct: FloatArray, share: float) -> Tested:
    """Test the mean of values `(r,)` above a share of the mean of direct `(s,)`."""
    found = Difference.ratio(values, direct)
    return _tested(found, (values, direct), lambda one: (one.above(share), one.below(share)), ".2f")


def near(values: FloatArray, direct: FloatArray, share: float, margin: float) -> Tested:
    """Test the mean of values `(r,)` within a margin of a share of the mean of direct `(s,)`."""
    found = Difference.ratio(values, direct)

    def both(one: Difference) -> tuple[float, float]:
        away = one._replace(value=one.value - share)
        return _doubled(away.within(margin)), min(away.above(margin), away.below(-margin))

    return _tested(found, (values, direct), both, ".2f")


def narrower(narrow: Sequence[FloatArray], wide: Sequence[FloatArray], threshold: float, size: float) -> Tested:
    """Test the ratio of two standard deviations below a threshold, by resamples of whole repetitions.

    A standard deviation is the root of the mean variance over groups and numbers of evaluations.

    Args:
        narrow: groups `(r, k)` by repetition and number of evaluations, each with two repetitions or more.
        wide: the same, of the denominator.
        threshold: of the ratio.
        size: the greatest ratio that agrees with the paper's.
    """
    rng = stream(0, "standard deviations")
    with np.errstate(all="ignore"):
        ratio = float(np.sqrt(_variance(narrow) / _variance(wide)))
        ratios = np.sqrt(_resampled(narrow, rng) / _resampled(wide, rng))
    if min(map(len, [*narrow, *wide])) < FEWEST_REPETITIONS or not np.isfinite(ratios).all():
        return Tested(None, None, f"{ratio:.2f}")
    low, high = np.quantile(ratios, [SIGNIFICANT / 2, 1 - SIGNIFICANT / 2])
    told = f"{ratio:.2f} ({low:.2f} to {high:.2f})"
    return Tested(_share(ratios >= threshold), _share(ratios <= threshold), told, _share(ratios <= size))


def contrast(firsts: Sequence[FloatArray], seconds: Sequence[FloatArray], unit: float) -> str:
    """Return the mean of some groups' means less that of others, as a share of direct, with its interval, in words.

    Args:
        firsts: groups `(r,)`; each counts alike, whatever its size.
        seconds: what is subtracted.
        unit: the mean of direct; nan for none.
    """
    means = [
        (sign / len(groups), mean)
        for sign, groups in ((1.0, firsts), (-1.0, seconds))
        for group in groups
        if (mean := Difference.mean(group)) is not None
    ]
    found = _over(Difference.sum(means), unit) if len(means) == len(firsts) + len(seconds) else None
    return "" if found is None else found.told(CONFIDENCE)


def _tested(found: Difference | None, groups: Sequence[FloatArray], test: Test, form: str = "+.3f") -> Tested:
    if found is None:
        return Tested(None, None, "")
    told = found.told(CONFIDENCE, form)
    if min(map(len, groups)) < FEWEST_REPETITIONS or not found.error:
        return Tested(None, None, told)
    return Tested(*test(found), told)


def _over(found: Difference | None, unit: float) -> Difference | None:
    """Return a difference as a share of direct, if there is one."""
    return found and Difference.sum([(1.0 if np.isnan(unit) else 1 / unit, found)])


def _size(least: float, unit: float) -> float:
    """Return the least size of a difference: none without a direct baseline."""
    return 0.0 if np.isnan(unit) else least


def _doubled(p: float) -> float:
    return min(1.0, 2 * p)


def _variance(groups: Sequence[FloatArray]) -> float:
    return float(np.mean([group.var(axis=0, ddof=1).mean() for group in groups]))


def _resampled(groups: Sequence[FloatArray], rng: np.random.Generator) -> FloatArray:
    """Return the mean variance of each resample, `(RESAMPLES,)`, without its bias: n values drawn from n vary less."""
    found = np.zeros(RESAMPLES)
    for group in groups:
        n = len(group)
        drawn = group[rng.integers(n, size=(RESAMPLES, n))]
        found += drawn.var(axis=1, ddof=1).mean(axis=1) * n / (n - 1) / len(groups)
    return found


def _share(resamples: np.ndarray[Any, np.dtype[np.bool_]]) -> float:
    return float(min(1.0, 2 * (1 + resamples.sum()) / (len(resamples) + 1)))


def smallest_found(deviation: float, n: tuple[int, int]) -> float:
    """Return the difference of two means that a two-sided test finds with the power `POWER`."""
    freedom = max(1, sum(n) - 2)
    quantiles = stats.t.ppf(1 - SIGNIFICANT / 2, freedom) + stats.t.ppf(POWER, freedom)
    return float(quantiles * deviation * (1 / n[0] + 1 / n[1]) ** 0.5)


def repetitions_needed(effect: float) -> int:
    """Return the repetitions that find a difference of so many standard deviations with the power `POWER`."""
    quantiles = stats.norm.ppf(1 - SIGNIFICANT / 2) + stats.norm.ppf(POWER)
    n = max(FEWEST_REPETITIONS, int(np.ceil(2 * (quantiles / effect) ** 2)))  # too few by one or two: t is wider
    while smallest_found(1.0, (n, n)) > effect:
        n += 1
    return n
