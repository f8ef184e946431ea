"""Array types by shape, and differences of readings on a circle; every number in the core is a float64."""

from math import isfinite
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]

Genome: TypeAlias = FloatArray
"""`(g,)`: one controller."""

Genomes: TypeAlias = FloatArray
"""`(n, g)`: n controllers."""

Parameters: TypeAlias = FloatArray
"""`(m, p)`: m simulators, a row of p tunables each, in the order of the spec."""

Fitnesses: TypeAlias = FloatArray
"""`(n, m)`: the fitness of n controllers in m simulators; nan where the physics failed."""


Readings: TypeAlias = FloatArray
"""`(q,)`: what the sensors said during one rollout, each divided by its noise; nan where it failed."""

Outcomes: TypeAlias = FloatArray
"""`(n, m, 1 + q)`: the fitness of n controllers in m simulators, and the readings of their sensors."""


def frozen(values: object) -> FloatArray:
    """Return a read-only float64 copy, for arrays in frozen values."""
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


def known(value: float) -> float | None:
    """Return the value, or None if it is not finite."""
    return float(value) if isfinite(value) else None


NO_READINGS: Readings = frozen([])
"""Readings of a robot without sensors."""


NO_GENOMES: Genomes = frozen(np.empty((0, 0)))
"""No controllers."""


def no_readings() -> Readings:
    """Return the readings of a robot without sensors, for fields of frozen values."""
    return NO_READINGS


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
