"""Differences of means, and two one-sided tests of whether they are within a margin."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from scipy.stats import norm

SIGNIFICANT = 0.05
Z = float(norm.isf(SIGNIFICANT))
TWO_SIDED = float(norm.isf(SIGNIFICANT / 2))


class Difference(NamedTuple):
    """A difference of means, and half of its 90 % interval."""

    value: float
    half: float

    @classmethod
    def of(cls, value: float | None, lower: float | None, upper: float | None) -> "Difference | None":
        """Return the difference with this interval; None if it is undefined."""
        return None if value is None or lower is None or upper is None else cls(value, (upper - lower) / 2)

    @classmethod
    def mean(cls, differences: Sequence["Difference"]) -> "Difference":
        """Return the mean of independent differences."""
        count = len(differences)
        half = math.sqrt(sum(each.half**2 for each in differences)) / count
        return cls(sum(each.value for each in differences) / count, half)

    @property
    def error(self) -> float:
        """Return the standard error as of a normal distribution, slightly above that of few repetitions."""
        return self.half / Z

    def p(self, margin: float) -> float:
        """Return p of the hypothesis that the difference is `margin` or more, either way."""
        return (
            float(norm.sf((margin - abs(self.value)) / self.error)) if self.error else float(abs(self.value) >= margin)
        )

    @property
    def p_of_none(self) -> float:
        """Return the two-sided p of the hypothesis that there is no difference."""
        return float(2 * norm.sf(abs(self.value) / self.error)) if self.error else float(self.value == 0.0)

    def verdict(self, margin: float) -> str:
        """Return whether the difference is shown to be within the margin, or shown to be one and not within."""
        if self.p(margin) < SIGNIFICANT:
            return "equivalent"
        return "different" if abs(self.value) > self.error * TWO_SIDED else "undecided"

    def cells(self, margin: float) -> tuple[str, str, str, str]:
        """Return the difference with its interval, p, the chance of equivalence, and the verdict."""
        interval = f"{self.value:.3f} ({self.value - self.half:.3f} to {self.value + self.half:.3f})"
        return interval, f"{self.p(margin):.2g}", f"{self.chance(margin):.2f}", self.verdict(margin)

    def chance(self, margin: float) -> float:
        """Return the probability that a true difference of 0 is shown to be within the margin."""
        if self.half >= margin:
            return 0.0
        return 2 * float(norm.cdf((margin - self.half) / self.error)) - 1 if self.error else 1.0
