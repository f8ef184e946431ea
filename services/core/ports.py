"""The two ways to ask what a controller is worth. That they are two types is the reality gap."""

from typing import Protocol

from gaplab.services.core.arrays import Fitnesses, Genome, Genomes, Parameters


class Simulate(Protocol):
    """Fitness of every genome in every simulator: the one hot path.

    It depends on its arguments alone and keeps their order, whatever ran before and however many workers there are.
    """

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """`(n, g)` genomes × `(m, p)` parameters -> `(n, m)` fitnesses; nan where the physics failed."""
        ...


class Reality(Protocol):
    """The real world: slow, hidden and counted, asked one genome at a time."""

    def __call__(self, genome: Genome) -> float:
        """The fitness of the genome `(g,)` in reality; nan if the measurement failed."""
        ...
