"""The ways to evaluate a controller. The reality gap is the difference between simulation and reality."""

from typing import Protocol

from gaplab.services.core.arrays import Fitnesses, Genome, Genomes, Outcomes, Parameters
from gaplab.services.core.types import Outcome


class Simulate(Protocol):
    """The fitness of every genome in every simulator: the one hot path.

    The result depends only on the arguments, in their order: not on earlier calls or the number of workers.
    """

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """Return fitnesses `(n, m)` of genomes `(n, g)` in simulators `(m, p)`; nan where the physics failed."""
        ...


class Sense(Protocol):
    """The same with the readings of the robot's sensors; all are nan where the physics failed.

    The fitness is that of Simulate, to the last bit.
    """

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Outcomes:
        """Return fitness and readings `(n, m, 1 + q)` of genomes `(n, g)` in simulators `(m, p)`."""
        ...


class Reality(Protocol):
    """The real world: slow and hidden; evaluates one genome at a time, and each evaluation counts."""

    def __call__(self, genome: Genome) -> Outcome:
        """Return fitness and readings of the genome `(g,)` in reality; a nan fitness if the measurement failed."""
        ...
