"""Rollouts, counted where they are spent."""

import numpy as np

from gaplab.services.core.arrays import Fitnesses, FloatArray, Genomes, Parameters
from gaplab.services.core.ports import Simulate
from gaplab.services.core.types import Cost


class Count:
    """A running count of rollouts, and of those among them that failed."""

    def __init__(self) -> None:
        self._rollouts = 0
        self._failures = 0

    def add(self, fitnesses: FloatArray) -> None:
        """So many more rollouts, of any shape."""
        self._rollouts += fitnesses.size
        self._failures += int(np.isnan(fitnesses).sum())

    def cost_of(self, budget: int) -> Cost:
        """What was counted so far, of so many rollouts that there might have been."""
        return Cost(self._rollouts, self._failures, budget - self._rollouts)


class Counted:
    """A Simulate that counts its rollouts.

    Attributes:
        count: of them so far.
    """

    def __init__(self, simulate: Simulate) -> None:
        self._simulate = simulate
        self.count = Count()

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """As the Simulate that it counts."""
        fitnesses = self._simulate(genomes, parameters)
        self.count.add(fitnesses)
        return fitnesses
