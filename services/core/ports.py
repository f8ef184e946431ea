"""The ways to evaluate a controller. The reality gap is the difference between simulation and reality."""

from collections.abc import Callable
from typing import Protocol

from gaplab.schemas.safety import Safety
from gaplab.services.core.arrays import Fitnesses, Genome, Genomes, Outcomes, Parameters
from gaplab.services.core.errors import RealityAwaited
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
        """Return fitness and readings of the genome `(g,)` in reality; a nan fitness if the measurement failed.

        Raises:
            RealityAwaited: reality is physical; the log goes on once the answer is in it.
        """
        ...


class Forecast(Protocol):
    """What simulators expect of a controller before a physical robot runs it; it changes no number."""

    def __call__(self, genome: Genome, parameters: Parameters, progress: Callable[[], None]) -> Safety:
        """Return the worst that simulators `(m, p)`, the best first, expect of the genome `(g,)`.

        After each rollout, `progress` is called.
        """
        ...


class PhysicalReality:
    """A Reality that people or a driver measure: the repetition waits for each answer, and holds nothing."""

    def __call__(self, genome: Genome) -> Outcome:
        """Ask for the measurement of a genome `(g,)`.

        Raises:
            RealityAwaited: always.
        """
        raise RealityAwaited(genome)
