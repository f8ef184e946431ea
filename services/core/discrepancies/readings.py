"""The discrepancy of what sensors say."""

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Outcomes
from gaplab.services.core.discrepancies.base import Discrepancy


class ReadingsOptions(Frozen):
    """Options of the discrepancy `readings`."""

    seconds: Annotated[float, Field(strict=True, gt=0, le=3_600)] = Field(
        default=1.0,
        description="readings up to this time after the first count; contact is chaotic, so later ones say less",
    )


class Readings(Discrepancy):
    """The squared differences between simulated and real readings, each in units of its noise; their mean.

    A term of 1 is as large as the noise of the sensors. Readings that a sensor failed to give do not count; a sample
    without any is refused, since every simulator would reproduce it.
    """

    name = "readings"
    source = "Bongard and Lipson 2004: readings rather than fitness; the first second and the mean are gaplab's"
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
        """Return the mean squared differences over the readings that count."""
        return np.asarray((self.residuals(simulated, measured, times_s) ** 2).sum(axis=-1))

    def residuals(self, simulated: Outcomes, measured: FloatArray, times_s: FloatArray) -> FloatArray:
        """Return the differences in units of noise, each divided by the root of the number of readings that count."""
        early = self._early(times_s)
        real = measured[:, None, 1 + early]
        there = ~np.isnan(real)
        count = np.maximum(there.sum(axis=-1, keepdims=True), 1)
        compared = there | np.isnan(simulated[..., :1])  # where the physics failed, all differences are nan
        return np.asarray(np.where(compared, simulated[..., 1 + early] - real, 0.0) / np.sqrt(count))

    def noise(self, measured: FloatArray, times_s: FloatArray) -> float:
        """Return the variance of one reading, 1 in units of its noise, divided by the number that count in a sample."""
        there = ~np.isnan(measured[:, 1 + self._early(times_s)])
        return 1.0 / float(np.maximum(there.sum(axis=1), 1).mean())

    def _early(self, times_s: FloatArray) -> NDArray[np.intp]:
        return np.flatnonzero(times_s <= times_s.min() + self.options.seconds + 1e-9)
