"""The two evaluations of a controller, in simulation and in reality. That they are two types is the reality gap."""

from typing import Protocol

from gaplab.services.core.arrays import Fitnesses, Genome, Genomes, Parameters


class Simulate(Protocol):
    """Fitness of every genome in every simulator: the hot path.

    The result depends on the arguments alone, not on earlier calls or the number of workers.
    """

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """Return the `(n, m)` fitnesses of genomes `(n, g)` in simulators `(m, p)`; nan where the physics failed."""
        ...


class Reality(Protocol):
    """Fitness in reality: slow, hidden and counted, one genome at a time."""

    def __call__(self, genome: Genome) -> float:
        """Return the fitness of a genome `(g,)` in reality; nan if the measurement failed."""
        ...
