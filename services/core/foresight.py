"""Rollouts that will probably be asked for next, done by cores that would idle meanwhile.

A steady-state search evaluates one newcomer at a time, for the next one may descend from it. But many newcomers are
dropped at once, and then the next one is what it would have been without them. So while one newcomer is evaluated,
those that follow if it is dropped are evaluated beside it. No number changes: a fitness that was foreseen is used only
for the genome that is then asked for.
"""

from collections.abc import Callable
from math import ceil

import numpy as np

from gaplab.services.core.arrays import Fitnesses, Genomes, Parameters
from gaplab.services.core.ports import Simulate

FARTHEST = 32
"""Newcomers to foresee at most; with one in ten that stays, more would help little."""


class Foresight:
    """A Simulate that is told what may be asked for next, and asks for it together with what is asked for now.

    Args:
        simulate: fitness in simulation; the same for a genome whatever else it is asked for with.
        batch: rollouts that it likes to be asked for at a time, now.
        simulators: that each genome is asked for in; always the same ones.
    """

    def __init__(self, simulate: Simulate, batch: Callable[[], int], simulators: int) -> None:
        self._simulate = simulate
        self._batch = batch
        self._simulators = simulators
        self._expected: Genomes | None = None
        self._foreseen: dict[bytes, Fitnesses] = {}

    def room(self) -> int:
        """How many genomes can be asked for at a time while cores are idle; 1 if none is."""
        return min(FARTHEST, ceil(self._batch() / self._simulators))

    def expect(self, genomes: Genomes) -> None:
        """These `(n, g)` will be asked for next, one after the other, if what is asked for now changes nothing."""
        self._expected = genomes

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """`(n, g)` genomes × `(m, p)` parameters -> `(n, m)` fitnesses, as the Simulate that was given."""
        keys = [genome.tobytes() for genome in genomes]
        if not all(key in self._foreseen for key in keys):
            together = genomes if self._expected is None else np.vstack([genomes, self._expected])
            fitnesses = self._simulate(together, parameters)
            self._foreseen = {genome.tobytes(): row for genome, row in zip(together, fitnesses, strict=True)}
        self._expected = None
        return np.array([self._foreseen[key] for key in keys])
