"""Differences of means with t-tests, and tests of single statements, each with the p that show it and refute it.

The standard error of a difference may have several parts: two groups, or the means of four. Its degrees of freedom then
are those of Welch and Satterthwaite. All p of statements are two-sided: a p of 0.05 is one of 0.025 on one side, so an
interval has 0 or the size within it exactly if the p is above 0.05.

Source: Satterthwaite 1946, An approximate distribution of estimates of variance components; Schuirmann 1987, A
comparison of the two one-sided tests procedure, for margins.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats

from benchmarks.reproduction.paper import LEAST_RATIO, NEARER_TO_A_THIRD
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.streams import stream
from gaplab.services.findings.judged import FEWEST_REPETITIONS
from gaplab.services.findings.statistics import SIGNIFICANT, both, constant, constant_difference, finite

RESAMPLES = 20_000
"""Resamples of the ratio of standard deviations; with 2 000, its p near 0.04 varies by 0.006."""


class Difference(NamedTuple):
    """A difference of means, or another sum of estimates; None stands for one of fewer than two values.

    Attributes:
        value: the difference.
        error: its standard error.
        freedom: degrees of freedom of the error; infinite if it is exactly 0.
    """

    value: float
    error: float
    freedom: float

    @classmethod
    def mean(cls, values: FloatArray) -> "Difference | None":
        """Return the mean of values `(n,)`, as a difference from 0."""
        there = finite(values)
        if len(there) < 2:
            return None
        error = 0.0 if constant(there) else float(there.std(ddof=1)) / math.sqrt(len(there))
        return cls(float(there.mean()), error, len(there) - 1 if error else math.inf)

    @classmethod
    def paired(cls, first: FloatArray, second: FloatArray) -> "Difference | None":
        """Return the mean difference of the repetitions that both `(r,)` and `(s,)` have."""
        one, other = both(first, second)
        found = cls.mean(one - other)
        fixed = found is not None and constant_difference(one, other)
        return found._replace(error=0.0, freedom=math.inf) if found and fixed else found

    @classmethod
    def unpaired(cls, first: FloatArray, second: FloatArray) -> "Difference | None":
        """Return the difference of the means of `(n,)` and `(m,)`, as Welch's t has it."""
        one, other = cls.mean(first), cls.mean(second)
        return None if one is None or other is None else cls.sum([(1.0, one), (-1.0, other)])

    @classmethod
    def ratio(cls, values: FloatArray, baseline: FloatArray) -> "Difference | None":
        """Return the mean of `(n,)` over that of a baseline `(m,)`, by the delta method."""
        one, base = cls.mean(values), cls.mean(baseline)
        if one is None or base is None:
            return None
        share = one.value / base.value
        return cls.sum([(1 / base.value, one), (-share / base.value, base)])._replace(value=share)

    @classmethod
    def of_ratios(cls, pairs: Sequence[FloatArray], bases: Sequence[FloatArray]) -> "Difference | None":
        """Return the difference of two means, each over the mean of its own baseline, with the errors of both.

        Repetitions `(r,)` are paired: they share random streams.
        """
        (one, two), base, other = both(*pairs), cls.mean(bases[0]), cls.mean(bases[1])
        if base is None or other is None or (paired := cls.paired(one / base.value, two / other.value)) is None:
            return None
        shares = float(one.mean()) / base.value**2, -float(two.mean()) / other.value**2
        return cls.sum([(1.0, paired), (shares[0], base), (shares[1], other)])._replace(value=paired.value)

    @classmethod
    def sum(cls, parts: Sequence[tuple[float, "Difference"]]) -> "Difference":
        """Return the sum of independent estimates, each times its factor."""
        squares = [(factor * each.error) ** 2 for factor, each in parts]
        parted = sum(square**2 / each.freedom for square, (_, each) in zip(squares, parts, strict=True))
        value = sum(factor * each.value for factor, each in parts)
        return cls(value, math.sqrt(sum(squares)), sum(squares) ** 2 / parted if parted else math.inf)

    @classmethod
    def pooled(cls, parts: Sequence["Difference"]) -> "Difference":
        """Return the mean of independent estimates of one difference, each weighted by the inverse of its variance."""
        weights = [each.error**-2 for each in parts]
        return cls.sum([(weight / sum(weights), each) for weight, each in zip(weights, parts, strict=True)])

    @property
    def p(self) -> float:
        """Return the two-sided p of the hypothesis that there is no difference."""
        return min(1.0, 2 * self._tail(abs(self.value)))

    def above(self, size: float) -> float:
        """Return the two-sided p of the hypothesis that the difference is `size`; 1 if its estimate is not above."""
        return min(1.0, 2 * self._tail(self.value - size))

    def below(self, size: float) -> float:
        """Return the two-sided p of the hypothesis that the difference is `size`; 1 if its estimate is not below."""
        return min(1.0, 2 * self._tail(size - self.value))

    def within(self, margin: float) -> float:
        """Return p of the hypothesis that the difference is `margin` or more, either way: two one-sided tests."""
        return self._tail(margin - abs(self.value))

    def told(self, form: str = "+.3f") -> str:
        """Return the difference with its 95 % interval in words."""
        half = float(stats.t.isf(SIGNIFICANT / 2, self.freedom)) * self.error if self.error else 0.0
        low, high = self.value - half, self.value + half
        return f"{self.value:{form}} ({low:{form}} to {high:{form}})".replace("-", "\N{MINUS SIGN}")

    def over(self, unit: float) -> "Difference":
        """Return it as a share of direct, whose mean is taken as exact; as it is if that is nan."""
        return Difference.sum([(1.0 if np.isnan(unit) else 1 / unit, self)])

    def _tail(self, distance: float) -> float:
        """Return the probability of an estimate that is further above the truth than a distance."""
        return float(stats.t.sf(distance / self.error, self.freedom)) if self.error else float(distance <= 0)


class Tested(NamedTuple):
    """A tested statement; p are None for fewer than `FEWEST_REPETITIONS` values, or if nothing varies.

    Attributes:
        shows: p of the hypothesis that it does not hold.
        refutes: p of the hypothesis that it holds in the size that refutes the claim.
        estimate: the estimate with its 95 % interval, in words.
        smaller: p of the hypothesis that it holds in the paper's size; None if `refutes` is that.
        found: the estimate; of a ratio, its logarithm.
        again: returns the same test of another estimate.
    """

    shows: float | None
    refutes: float | None
    estimate: str
    smaller: float | None = None
    found: Difference | None = None
    again: "Callable[[Difference], Tested] | None" = None


def pooled(parts: Sequence[Tested]) -> Tested:
    """Return the same test of one statement in several studies, each weighted by the inverse of its variance.

    Studies in which it is not tested are left out.
    """
    found = [each.found for each in parts if each.found and each.shows is not None]
    if not found or parts[0].again is None:
        return Tested(None, None, "")
    return parts[0].again(Difference.pooled(found))


def above(groups: Sequence[FloatArray], least: float, unit: float) -> Tested:
    """Test the mean of one group `(n,)` above 0, or above the mean of a second one, as shares of direct, `unit`.

    Refuted if the difference is shown to be below `least`, or below 0 without direct.
    """
    found = Difference.unpaired(*groups) if len(groups) > 1 else Difference.mean(*groups)
    size = 0.0 if np.isnan(unit) else least
    return _tested(found and found.over(unit), groups, lambda one: (one.above(0.0), one.below(size)))


def reaches(values: FloatArray, direct: FloatArray, share: float) -> Tested:
    """Test the mean of values `(r,)` above a share of the mean of direct `(s,)`."""
    found = Difference.ratio(values, direct)
    return _tested(found, (values, direct), lambda one: (one.above(share), one.below(share)), ".2f")


def near(values: FloatArray, direct: FloatArray, share: float, margin: float) -> Tested:
    """Test the mean of values `(r,)` within a margin of a share of the mean of direct `(s,)`."""

    def test(one: Difference) -> tuple[float, float]:
        away = one._replace(value=one.value - share)
        return min(1.0, 2 * away.within(margin)), min(away.above(margin), away.below(-margin))

    return _tested(Difference.ratio(values, direct), (values, direct), test, ".2f")


def narrower(narrow: Sequence[FloatArray], wide: Sequence[FloatArray]) -> Tested:
    """Test the ratio of two standard deviations below `NEARER_TO_A_THIRD`, by resamples of whole repetitions.

    A standard deviation is the root of the mean variance over groups `(r, k)` and numbers of evaluations.
    """
    rng, sides = stream(0, "standard deviations"), (narrow, wide)
    with np.errstate(all="ignore"):
        variances = [np.mean([group.var(axis=0, ddof=1).mean() for group in groups]) for groups in sides]
        ratio, resampled = float(np.sqrt(variances[0] / variances[1])), [_resampled(groups, rng) for groups in sides]
        ratios = np.sqrt(resampled[0] / resampled[1])
    if min(map(len, [*narrow, *wide])) < FEWEST_REPETITIONS or not np.isfinite(ratios).all():
        return Tested(None, None, f"{ratio:.2f}")
    low, high = np.quantile(ratios, [SIGNIFICANT / 2, 1 - SIGNIFICANT / 2])
    counts = (ratios >= NEARER_TO_A_THIRD, ratios <= NEARER_TO_A_THIRD, ratios <= LEAST_RATIO)
    shows, refutes, smaller = (min(1.0, 2 * (1 + int(each.sum())) / (RESAMPLES + 1)) for each in counts)
    found = Difference(float(np.log(ratio)), float(np.log(ratios).std()), math.inf)
    return Tested(shows, refutes, f"{ratio:.2f} ({low:.2f} to {high:.2f})", smaller, found, _of_logarithm)


def _of_logarithm(found: Difference) -> Tested:
    near, least = math.log(NEARER_TO_A_THIRD), math.log(LEAST_RATIO)
    low, high = (math.exp(found.value + side * 1.96 * found.error) for side in (-1, 1))
    told = f"{math.exp(found.value):.2f} ({low:.2f} to {high:.2f})"
    return Tested(found.below(near), found.above(near), told, found.above(least))


def _tested(
    found: Difference | None,
    groups: Sequence[FloatArray],
    test: Callable[[Difference], tuple[float, float]],
    form: str = "+.3f",
) -> Tested:
    known = found and found.error and min(map(len, groups)) >= FEWEST_REPETITIONS
    shows, refutes = test(found) if found and known else (None, None)
    told = found.told(form) if found else ""
    return Tested(shows, refutes, told, found=found, again=lambda one: Tested(*test(one), one.told(form)))


def _resampled(groups: Sequence[FloatArray], rng: np.random.Generator) -> FloatArray:
    """Return the mean variance of each resample, `(RESAMPLES,)`, without its bias: n values drawn from n vary less."""
    found = np.zeros(RESAMPLES)
    for group in groups:
        n = len(group)
        drawn = group[rng.integers(n, size=(RESAMPLES, n))]
        found += drawn.var(axis=1, ddof=1).mean(axis=1) * n / (n - 1) / len(groups)
    return found
