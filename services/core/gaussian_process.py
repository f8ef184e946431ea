"""A Gaussian process: what a few measured values say of all others, with how sure that is.

It is NumPy's linear algebra, since scikit-learn would be a heavy dependency for a handful of points, and has neither
periodic coordinates nor the error of an estimated mean.

Source: Sacks, Welch, Mitchell and Wynn 1989; DACE (Lophaven, Nielsen and Søndergaard 2002), for mean and likelihood;
Rasmussen and Williams 2006, for the kernels.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Literal, TypeAlias

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.space import Space

NUGGET = 1e-10
"""Least noise, as a share of the variance: without any, equal points have no inverse."""

CANDIDATES = 32
"""Values of which the likeliest is taken, evenly spaced in their logarithm: a likelihood may have several maxima."""

ROUNDING = 1e-9
"""Deviation of values, as a share of the largest, up to which they do not tell their variance; it is 1 then."""

KERNELS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "squared_exponential": lambda away: np.exp(-0.5 * away**2),
    "matern52": lambda away: (1 + 5**0.5 * away + 5 / 3 * away**2) * np.exp(-(5**0.5) * away),
}
"""Correlations at distances in units of the length scale."""

Kernel: TypeAlias = Literal["squared_exponential", "matern52"]


@dataclass(frozen=True, eq=False)
class Posterior:
    """A Gaussian process, given values at n points.

    Attributes:
        space: of the points.
        places: `(n, c)`: coordinates of the points as `_places` has them.
        kernel: correlation by distance.
        length_scale: in units of the extents.
        mean: constant mean, in the unit of the values.
        variance: about that mean.
        factor: `(n, n)`: Cholesky factor of the correlations with noise.
        left: `(n,)`: differences of the values from the mean, in units of that factor.
        ones: `(n,)`: the constant 1 in the same units, if the mean is estimated; `(0,)` if it is given.
    """

    space: Space
    places: FloatArray
    kernel: Kernel
    length_scale: float
    mean: float
    variance: float
    factor: FloatArray
    left: FloatArray
    ones: FloatArray

    def predict(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the expected values `(k,)` at points `(k, g)`, and the standard deviations of what they are."""
        away = _apart(_places(self.space, points), self.places) / self.length_scale
        known = np.linalg.solve(self.factor, KERNELS[self.kernel](away).T)
        unknown = 1.0 - (known * known).sum(axis=0)
        if self.ones.size:
            unknown = unknown + (1.0 - self.ones @ known) ** 2 / (self.ones @ self.ones)
        return self.mean + self.left @ known, np.sqrt(self.variance * np.maximum(unknown, 0.0))


@dataclass(frozen=True)
class GaussianProcess:
    """A Gaussian process with one length scale, before any value is known.

    For a prior mean that varies, model the differences from it, with a mean of 0.

    Attributes:
        kernel: correlation by distance.
        length_scale: in units of the extents, or the bounds between which the likeliest is taken.
        noise: variance of the values' noise as a share of the variance, or such bounds, above 0.
        mean: constant mean; None: estimated.
        variance: about the mean; None: the likeliest.
    """

    kernel: Kernel = "squared_exponential"
    length_scale: float | tuple[float, float] = (0.1, 1.0)
    noise: float | tuple[float, float] = 0.0
    mean: float | None = None
    variance: float | None = None

    def given(self, space: Space, points: FloatArray, values: FloatArray) -> Posterior:
        """Return the likeliest process that has finite values `(n,)` at points `(n, g)`, n ≥ 1."""
        places = _places(space, points)
        apart, size, found = _apart(places, places), len(values), list[tuple[float, Posterior]]()
        for length_scale, noise in product(_candidates(self.length_scale), _candidates(self.noise)):
            correlations = KERNELS[self.kernel](apart / length_scale)
            noisy = correlations + (noise + NUGGET) * np.eye(size)
            factor = np.asarray(np.linalg.cholesky(noisy), dtype=np.float64)
            ones, scaled = np.linalg.solve(factor, np.column_stack([np.ones(size), values])).T
            mean = float(ones @ scaled / (ones @ ones)) if self.mean is None else self.mean
            left = scaled - mean * ones
            spread = float(left @ left) / size
            varies = spread > (ROUNDING * np.abs(values).max()) ** 2
            variance = self.variance or (spread if varies else 1.0)
            unlikely = left @ left / variance + size * np.log(variance) + 2 * np.log(np.diag(factor)).sum()
            estimated = ones if self.mean is None else ones[:0]
            model = Posterior(space, places, self.kernel, length_scale, mean, variance, factor, left, estimated)
            found.append((float(unlikely), model))
        return min(found, key=lambda each: each[0])[1]


def _places(space: Space, points: FloatArray) -> FloatArray:
    """Return coordinates in units of the extents, and (cos, sin) of phases, a small step of which is as long."""
    shares = (points - space.lower) / space.extent
    turns = 2 * np.pi * shares[:, space.periodic]
    return np.hstack([shares[:, ~space.periodic], np.cos(turns) / (2 * np.pi), np.sin(turns) / (2 * np.pi)])


def _apart(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the distances `(k, n)` of places `(k, c)` from others `(n, c)`."""
    return np.asarray(np.linalg.norm(first[:, None, :] - second[None, :, :], axis=2))


def _candidates(value: float | tuple[float, float]) -> list[float]:
    return [float(each) for each in np.geomspace(*value, CANDIDATES)] if isinstance(value, tuple) else [value]
