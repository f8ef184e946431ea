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
    """

    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    noises: FloatArray = field(default_factory=no_readings)
    times_s: FloatArray = field(default_factory=no_readings)

    @property
    def size(self) -> int:
        """Return the number of readings of a rollout, q = r · s: all sensors at the first time, then at the next."""
        return len(self.names) * len(self.times_s)

    @property
    def reading_times_s(self) -> FloatArray:
        """Return the time of each reading, `(q,)`."""
        return np.repeat(self.times_s, len(self.names))

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
        sensors = [{"name": name, "unit": unit, "noise": noise} for name, unit, noise in named]
        return {"sensors": sensors, "reading_times_s": self.times_s.tolist()}

    def standardised(self, values: FloatArray) -> FloatArray:
        """Return readings `(..., q)`, each divided by its noise, from values `(..., r, s)` in the sensors' units."""
        return (values / self.noises).reshape(*values.shape[:-2], self.size)

    def values(self, readings: FloatArray) -> FloatArray:
        """Return values `(..., r, s)` in the sensors' units, from readings `(..., q)`."""
        return readings.reshape(*readings.shape[:-1], len(self.times_s), len(self.names)) * self.noises
