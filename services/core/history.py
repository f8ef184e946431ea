"""The history of a repetition: all that its next step follows from, gathered from the log."""

from dataclasses import dataclass, replace

import numpy as np

from gaplab.services.core.arrays import Genome
from gaplab.services.core.types import Measured, Sample, Simulator, Step, Transferred, Tuned


@dataclass(frozen=True, eq=False)
class History:
    """The result of the steps so far.

    Attributes:
        last: the latest step; None at the very start.
        samples: samples measured so far.
        simulators: simulators of the latest tuning, best first.
        transferred: the latest transferred genome.
        scale: size of the fitness in simulation of the first transferred controller that has one; None without any.
    """

    last: Step | None = None
    samples: tuple[Sample, ...] = ()
    simulators: tuple[Simulator, ...] = ()
    transferred: Genome | None = None
    scale: float | None = None

    def after(self, step: Step) -> "History":
        """Return the history with one more step."""
        match step:
            case Measured(sample=sample):
                return replace(self, last=step, samples=(*self.samples, sample))
            case Tuned(simulators=simulators):
                return replace(self, last=step, simulators=simulators)
            case Transferred(genome=genome, fitness=fitness):
                return replace(self, last=step, transferred=genome, scale=self.scale or _size(fitness))
        return replace(self, last=step)


def _size(fitness: float) -> float | None:
    """Return the size of a fitness; None of nan, of an infinity and of 0, which are no scale."""
    return abs(fitness) or None if np.isfinite(fitness) else None
