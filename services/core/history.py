"""The result of the steps of a repetition so far, read from its log, and what is recorded of a probe after them."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from gaplab.services.core.arrays import NO_READINGS, FloatArray, Readings
from gaplab.services.core.types import Measured, Probed, Sample, Simulator, Step, Transferred, Tuned


@dataclass(frozen=True, eq=False)
class History:
    """The result of the steps so far.

    Attributes:
        last: the latest step; None at the very start.
        samples: samples measured so far.
        simulators: simulators of the latest tuning, best first.
        transferred: the latest transferred controller.
        probed: its latest probe.
        scale: size of the fitness in simulation of the first transferred controller that has one; None without any.
    """

    last: Step | None = None
    samples: tuple[Sample, ...] = ()
    simulators: tuple[Simulator, ...] = ()
    transferred: Transferred | None = None
    probed: Probed | None = None
    scale: float | None = None

    def after(self, step: Step) -> "History":
        """Return the history with one more step."""
        match step:
            case Measured(sample=sample):
                return replace(self, last=step, samples=(*self.samples, sample))
            case Tuned(simulators=simulators):
                return replace(self, last=step, simulators=simulators)
            case Transferred(fitness=fitness):
                return replace(self, last=step, transferred=step, scale=self.scale or _size(fitness))
            case Probed():
                return replace(self, last=step, probed=step)
        return replace(self, last=step)


def _size(fitness: float) -> float | None:
    """Return the size of a fitness; None of nan, of an infinity and of 0, which are not scales."""
    return abs(fitness) or None if np.isfinite(fitness) else None


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
