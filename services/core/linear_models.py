"""Linear models of many answers of simulators, and the place that given answers come from.

Source: statistical linearisation, as in iterated Kalman filters; all numbers are gaplab's.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gaplab.services.core.arrays import FloatArray

PRIOR_VARIANCE = 0.25
"""Variance of a tunable before any sample, in units of its bounds. It is three times that of a uniform one, so that a
truth on a bound is hardly drawn to the middle."""

OWN = 0.3
"""Share of the scatter of an answer that is taken as its own, independent of the others."""

FARTHEST = 3.0
"""Deviations from the median at which an answer is cut; a robot that falls is not a line."""


def cutter(answers: FloatArray, noise: float) -> Callable[[FloatArray], FloatArray]:
    """Return what cuts answers `(…, r)` at `FARTHEST` deviations from the medians of these answers `(n, r)`."""
    import scipy  # a process that never tunes starts without it

    middle = np.median(answers, axis=0)
    deviation = scipy.stats.median_abs_deviation(answers, axis=0, scale="normal")
    reach = FARTHEST * np.maximum(deviation, noise**0.5)
    return lambda others: np.clip(others, middle - reach, middle + reach)


@dataclass(frozen=True, eq=False)
class LinearModel:
    """A linear model of r answers over p tunables, in units of their bounds.

    Attributes:
        centre: `(p,)`: mean of the places that it was fitted to.
        level: `(r,)`: answers there.
        slopes: `(r, p)`.
        scatter: `(r,)`: variance of an answer around the model, with the noise.
        weighted: `(r, p)`: the slopes, weighted by the inverse of the answers' covariance.
    """

    centre: FloatArray
    level: FloatArray
    slopes: FloatArray
    scatter: FloatArray
    weighted: FloatArray

    @classmethod
    def of(cls, places: FloatArray, answers: FloatArray, noise: float) -> "LinearModel":
        """Return the model of n answers `(n, r)` at places `(n, p)`.

        Their covariance is low-rank plus diagonal, so that it can be inverted although there are more answers than
        places.

        Args:
            places: from 0 to 1.
            answers: cut, so that one that is far off moves no line.
            noise: variance of an answer of the right simulator.
        """
        (count, size), centre = places.shape, places.mean(axis=0)
        design = np.column_stack([np.ones(count), places - centre])
        lines, *_ = np.linalg.lstsq(design, answers, rcond=None)
        level, slopes = lines[0], lines[1:].T
        scatter = (answers - design @ lines) / np.sqrt(max(1, count - size - 1))
        squares = (scatter**2).sum(axis=0)
        own = OWN * squares + noise
        own = np.maximum(own, 1e-12 * max(float(own.max()), 1e-300))
        shared = np.sqrt(1 - OWN) * scatter
        weighted = slopes / own[:, None]
        inner = np.eye(count) + shared / own @ shared.T
        weighted -= shared.T / own[:, None] @ np.linalg.solve(inner, shared @ weighted)
        return cls(centre, level, slopes, squares + noise, weighted)

    def place(self, asked: FloatArray) -> FloatArray:
        """Return the place `(p,)` whose answers are those asked for, `(r,)`: the mean of a normal posterior."""
        size = len(self.centre)
        middle = np.full(size, 0.5)
        away = asked - self.level - self.slopes @ (middle - self.centre)
        known = self.slopes.T @ self.weighted + np.eye(size) / PRIOR_VARIANCE
        found = middle + np.linalg.solve(known, self.weighted.T @ away)
        return np.asarray(np.clip(found, 0.0, 1.0))

    def at(self, place: FloatArray) -> FloatArray:
        """Return the answers `(r,)` at a place `(p,)`."""
        return np.asarray(self.level + self.slopes @ (place - self.centre))
