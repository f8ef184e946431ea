"""Sensors whose readings tune simulators."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gaplab.services.core.arrays import FloatArray, no_readings


@dataclass(frozen=True, eq=False)
class Sensors:
    """The sensors of a robot, and the times at which all of them are read.

    Attributes:
        names: name of each of the s sensors.
        units: unit of each.
        noises: `(s,)`: standard deviation of each sensor's noise, in its unit.
        times_s: `(r,)`, ascending: seconds from the start of a rollout.
        periods: `(s,)`: by how much a reading may differ and mean the same, in its unit, like 2π of an angle; 0 if by
            nothing. Left out: 0 for all.
    """

    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    noises: FloatArray = field(default_factory=no_readings)
    times_s: FloatArray = field(default_factory=no_readings)
    periods: FloatArray = field(default_factory=no_readings)

    @property
    def size(self) -> int:
        """Return the number of readings of a rollout, q = r · s: all sensors at the first time, then at the next."""
        return len(self.names) * len(self.times_s)

    @property
    def reading_times_s(self) -> FloatArray:
        """Return the time of each reading, `(q,)`."""
        return np.repeat(self.times_s, len(self.names))

    @property
    def reading_periods(self) -> FloatArray:
        """Return the period of each reading, `(q,)`, over its noise."""
        each = self.periods / self.noises if self.periods.size else np.zeros(len(self.names))
        return np.tile(each, len(self.times_s))

    @property
    def times(self) -> tuple[str, ...]:
        """Return the times as texts, so exact that a reading is found by one of them."""
        return tuple(f"{time:.12g}" for time in self.times_s)

    @property
    def columns(self) -> tuple[str, ...]:
        """Return the name of each reading in tables, `(q,)`, like `roll@0.75`."""
        return tuple(f"{name}@{time}" for time in self.times for name in self.names)

    def details(self) -> dict[str, Any]:
        """Return name, unit and noise of each sensor, and the times of reading, for the catalogue."""
        named = zip(self.names, self.units, self.noises.tolist(), strict=True)
        sensors: list[dict[str, Any]] = [{"name": name, "unit": unit, "noise": noise} for name, unit, noise in named]
        for sensor, period in zip(sensors, self.periods.tolist(), strict=False):
            sensor |= {"period": period} if period else {}
        return {"sensors": sensors, "reading_times_s": self.times_s.tolist()}

    def standardised(self, values: FloatArray) -> FloatArray:
        """Return readings `(..., q)`, each divided by its noise, from values `(..., r, s)` in the sensors' units."""
        return (values / self.noises).reshape(*values.shape[:-2], self.size)

    def values(self, readings: FloatArray) -> FloatArray:
        """Return values `(..., r, s)` in the sensors' units, from readings `(..., q)`."""
        return readings.reshape(*readings.shape[:-1], len(self.times_s), len(self.names)) * self.noises


def nearest(readings: FloatArray, to: FloatArray, periods: FloatArray) -> FloatArray:
    """Return readings shifted by whole periods next to others, so that their difference is that on a circle.

    Args:
        readings: `(..., q)`, or outcomes `(..., 1 + q)`, whose fitness stays.
        to: the others, of a shape that broadcasts to it.
        periods: `(q,)`: period of each reading; 0 if it has none.
    """
    turning = np.flatnonzero(periods)
    if not turning.size:
        return readings
    places, size = turning + readings.shape[-1] - len(periods), periods[turning]
    turns = np.rint((readings[..., places] - to[..., places]) / size)
    turns[np.isnan(turns)] = 0.0
    if not turns.any():
        return readings
    shifted = readings.copy()
    shifted[..., places] -= turns * size
    return shifted
