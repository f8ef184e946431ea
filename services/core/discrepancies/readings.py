"""The discrepancy of what sensors say."""

from math import pi, sqrt
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Outcomes
from gaplab.services.core.discrepancies.base import Discrepancy

MEAN_ABSOLUTE = sqrt(2 / pi)
"""Mean absolute value of a standard normal number."""


class ReadingsOptions(Frozen):
    """Options of the discrepancy `readings`."""

    seconds: Annotated[float, Field(strict=True, gt=0, le=3_600)] = Field(
        default=1.0,
        description="readings up to this time after the first count; contact is chaotic, so later ones say less",
    )
    absolute_weight: Annotated[float, Field(strict=True, ge=0, le=1e6)] = Field(
        default=0.0, description="weight of absolute differences beside squared ones, whose weight is 1; SimOpt's: 0.5"
    )


class Readings(Discrepancy):
    """The squared differences between simulated and real readings, each in units of its noise; their mean.

    A term of 1 is as large as the noise of the sensors. Readings that a sensor failed to give do not count; a sample
    without any is refused, since every simulator would reproduce it. With an `absolute_weight`, absolute differences
    are added: small ones count more. A residual is then the root of both, with the sign of the difference.
    """

    name = "readings"
    source = (
        "Bongard and Lipson 2004: readings rather than fitness; Chebotar et al. 2019: absolute differences beside "
        "squared ones, there filtered over time; the first second and the mean are gaplab's"
    )
    senses = True
    squares = True
    error_text = "root mean square difference between readings in simulation and in reality, over the sensors' noise"
    Options = ReadingsOptions
    options: ReadingsOptions

    def lack(self, readings: FloatArray, times_s: FloatArray) -> str | None:
        """Return what is missing if no reading is early enough; else None."""
        if not np.isnan(readings[self._early(times_s)]).all():
            return None
        return f"a reading up to {self.options.seconds:g} s after the first"

    def terms(self, simulated: Outcomes, measured: FloatArray, times_s: FloatArray) -> FloatArray:
        """Return the mean squared differences over the readings that count, with the absolute ones by their weight."""
        return np.asarray((self.residuals(simulated, measured, times_s) ** 2).sum(axis=-1))

    def residuals(self, simulated: Outcomes, measured: FloatArray, times_s: FloatArray) -> FloatArray:
        """Return the differences in units of noise, each divided by the root of the number of readings that count.

        With an `absolute_weight` w, a difference d is ±√(d² + w |d|).
        """
        early = self._early(times_s)
        real = measured[:, None, 1 + early]
        there = ~np.isnan(real)
        count = np.maximum(there.sum(axis=-1, keepdims=True), 1)
        compared = there | np.isnan(simulated[..., :1])  # where the physics failed, all differences are nan
        away = np.where(compared, simulated[..., 1 + early] - real, 0.0)
        if weight := self.options.absolute_weight:
            away = np.copysign(np.sqrt(away**2 + weight * np.abs(away)), away)
        return np.asarray(away / np.sqrt(count))

    def noise(self, measured: FloatArray, times_s: FloatArray) -> float:
        """Return the variance of a residual by noise alone: 1 of one reading, divided by the number that count."""
        there = ~np.isnan(measured[:, 1 + self._early(times_s)])
        variance = 1.0 + self.options.absolute_weight * MEAN_ABSOLUTE
        return variance / float(np.maximum(there.sum(axis=1), 1).mean())

    def floor(self, error: float) -> float:
        """Return the discrepancy of a simulator all of whose readings are off by `error`, on one sample alone."""
        return error**2 + self.options.absolute_weight * error

    def error(self, term: float) -> float:
        """Return the difference of all readings that has this mean term."""
        half = self.options.absolute_weight / 2
        return sqrt(term + half**2) - half

    def _early(self, times_s: FloatArray) -> NDArray[np.intp]:
        return np.flatnonzero(times_s <= times_s.min() + self.options.seconds + 1e-9)
