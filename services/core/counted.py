"""Rollouts, counted where they are spent."""

import numpy as np

from services.core.arrays import Fitnesses, Genomes, Parameters
from services.core.ports import Simulate
from services.core.types import Cost


class Counted:
    """A Simulate that counts its rollouts and how many of them failed."""

    def __init__(self, simulate: Simulate) -> None:
        self._simulate = simulate
        self._rollouts = 0
        self._failures = 0

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """As the Simulate that it counts."""
        fitnesses = self._simulate(genomes, parameters)
        self._rollouts += fitnesses.size
        self._failures += int(np.isnan(fitnesses).sum())
        return fitnesses

    def cost_of(self, budget: int) -> Cost:
        """What was counted so far, of so many rollouts that there might have been."""
        return Cost(self._rollouts, self._failures, budget - self._rollouts)
