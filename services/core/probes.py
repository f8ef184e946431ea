"""Probes: what is recorded of the transferred controller of an iteration."""

from collections.abc import Iterable

import numpy as np

from gaplab.services.core.arrays import NO_READINGS, FloatArray, Readings
from gaplab.services.core.history import History
from gaplab.services.core.types import Probed, Sample


def probe_of(
    history: History,
    iteration: int,
    fitness: float,
    readings: Readings = NO_READINGS,
    repeats: FloatArray = NO_READINGS,
    *,
    left_out: bool = False,
) -> Probed:
    """Return the probe with this outcome, after these steps."""
    recorded = recorded_fitness(fitness, history.samples)
    return Probed(iteration, fitness, recorded, readings, repeats, left_out)


def recorded_fitness(probe: float, samples: Iterable[Sample]) -> float:
    """Return the larger fitness of the probe and the best sample; nan if every measurement failed.

    It can fall from one iteration to the next. Only its floor, the best sample so far, cannot.

    Source: paper, section 3.
    """
    measured = [value for value in (probe, *(each.fitness for each in samples)) if np.isfinite(value)]
    return max(measured, default=float("nan"))
