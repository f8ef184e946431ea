"""Differences of means, and of ratios of means, with t-tests of whether they are 0, above a size, or within a margin.

A standard error may have several parts: two groups, or the means of four. Its degrees of freedom then are those of
Welch and Satterthwaite.

Source: Satterthwaite 1946, An approximate distribution of estimates of variance components; Schuirmann 1987, A
comparison of the two one-sided tests procedure, for margins.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from scipy import stats

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.equivalence import SIGNIFICANT
from gaplab.services.core.statistics import both, constant, constant_difference, finite

MINUS = "\N{MINUS SIGN}"


class Difference(NamedTuple):
    """A difference of means, or another sum of estimates.

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
        """Return the mean of values `(n,)`, as a difference from 0; None for fewer than two."""
        there = finite(values)
        if len(there) < 2:
            return None
        error = 0.0 if constant(there) else float(there.std(ddof=1)) / math.sqrt(len(there))
        return cls(float(there.mean()), error, len(there) - 1 if error else math.inf)

    @classmethod
    def paired(cls, first: FloatArray, second: FloatArray) -> "Difference | None":
        """Return the mean difference of the repetitions that both `(r,)` and `(s,)` have; None for fewer than two."""
        one, other = both(first, second)
        found = cls.mean(one - other)
        fixed = found is not None and constant_difference(one, other)
        return found._replace(error=0.0, freedom=math.inf) if found and fixed else found

    @classmethod
    def unpaired(cls, first: FloatArray, second: FloatArray) -> "Difference | None":
        """Return the difference of the means of `(n,)` and `(m,)`, as Welch's t has it; None for fewer than two."""
        one, other = cls.mean(first), cls.mean(second)
        return None if one is None or other is None else cls.sum([(1.0, one), (-1.0, other)])

    @classmethod
    def ratio(cls, values: FloatArray, baseline: FloatArray) -> "Difference | None":
        """Return the mean of `(n,)` over that of a baseline `(m,)`, by the delta method; None for fewer than two."""
        one, base = cls.mean(values), cls.mean(baseline)
        if one is None or base is None:
            return None
        share = one.value / base.value
        return cls.sum([(1 / base.value, one), (-share / base.value, base)])._replace(value=share)

    @classmethod
    def sum(cls, parts: Sequence[tuple[float, "Difference"]]) -> "Difference":
        """Return the sum of independent estimates, each times its factor."""
        squares = [(factor * each.error) ** 2 for factor, each in parts]
        parted = sum(square**2 / each.freedom for square, (_, each) in zip(squares, parts, strict=True))
        value = sum(factor * each.value for factor, each in parts)
        return cls(value, math.sqrt(sum(squares)), sum(squares) ** 2 / parted if parted else math.inf)

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

    def interval(self, confidence: float) -> tuple[float, float]:
        """Return the ends of the interval of the difference."""
        half = self._half(confidence)
        return self.value - half, self.value + half

    def told(self, confidence: float, form: str = "+.3f") -> str:
        """Return the difference with its interval in words."""
        low, high = self.interval(confidence)
        return f"{self.value:{form}} ({low:{form}} to {high:{form}})".replace("-", MINUS)

    def verdict(self, margin: float) -> str:
        """Return whether the difference is shown to be within the margin, or shown to be one and not within."""
        if self.within(margin) < SIGNIFICANT:
            return "equivalent"
        return "different" if self.p < SIGNIFICANT else "undecided"

    def power_at_zero(self, margin: float) -> float:
        """Return the probability that a true difference of 0 is shown to be within the margin."""
        half = self._half(1 - 2 * SIGNIFICANT)
        if half >= margin:
            return 0.0
        return 2 * float(stats.t.cdf((margin - half) / self.error, self.freedom)) - 1 if self.error else 1.0

    def cells(self, margin: float) -> tuple[str, str, str, str]:
        """Return the difference with its 90 % interval, p, the chance of equivalence, and the verdict."""
        told = self.told(1 - 2 * SIGNIFICANT, ".3f").replace(MINUS, "-")
        return told, f"{self.within(margin):.2g}", f"{self.power_at_zero(margin):.2f}", self.verdict(margin)

    def _half(self, confidence: float) -> float:
        return float(stats.t.isf((1 - confidence) / 2, self.freedom)) * self.error if self.error else 0.0

    def _tail(self, distance: float) -> float:
        """Return the probability of an estimate that is further above the truth than a distance."""
        return float(stats.t.sf(distance / self.error, self.freedom)) if self.error else float(distance <= 0)
