"""The two ways to evaluate a controller. The reality gap is the difference between these two types."""

from typing import Protocol

from gaplab.services.core.arrays import Fitnesses, Genome, Genomes, Parameters


class Simulate(Protocol):
    """The fitness of every genome in every simulator: the one hot path.

    The result depends only on the arguments, in their order: not on earlier calls or the number of workers.
    """

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """Return fitnesses `(n, m)` of genomes `(n, g)` in simulators `(m, p)`; nan where the physics failed."""
        ...


class Reality(Protocol):
    """The real world: slow and hidden; evaluates one genome at a time, and each evaluation counts."""

    def __call__(self, genome: Genome) -> float:
        """Return the fitness of the genome `(g,)` in reality; nan if the measurement failed."""
        ...
