"""The ways to evaluate a controller. The reality gap is the difference between simulation and reality."""

from collections.abc import Callable
from typing import TypeAlias

from gaplab.schemas.measurements import Safety
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes, Outcomes, Parameters
from gaplab.services.core.errors import GaplabError
from gaplab.services.core.types import Outcome


class RealityAwaited(GaplabError):
    """Reality is physical: the repetition waits for the measurement of a genome.

    Attributes:
        genome: `(g,)`.
    """

    def __init__(self, genome: FloatArray) -> None:
        self.genome = genome
        super().__init__("a measurement of the physical robot is awaited")


Simulate: TypeAlias = Callable[[Genomes, Parameters], Fitnesses]
"""The one hot path: from genomes `(n, g)` and simulators `(m, p)` to fitnesses `(n, m)`; nan where the physics failed.

The result depends only on the arguments, in their order: not on earlier calls or the number of workers.
"""

Sense: TypeAlias = Callable[[Genomes, Parameters], Outcomes]
"""The same with the readings of the robot's sensors, `(n, m, 1 + q)`; all are nan where the physics failed.

The fitness is that of Simulate, to the last bit.
"""

Reality: TypeAlias = Callable[[Genome], Outcome]
"""The real world: slow and hidden; evaluates one genome `(g,)` at a time, and each evaluation counts.

The fitness is nan if the measurement failed. It raises RealityAwaited if reality is physical; the log goes on once the
answer is in it.
"""

Forecast: TypeAlias = Callable[[Genome, Parameters, Callable[[], None]], Safety]
"""The worst that simulators `(m, p)`, the best first, expect of a genome `(g,)` before a physical robot runs it.

It changes no number. After each rollout, it calls its last argument.
"""


def physical_reality(genome: Genome) -> Outcome:
    """Ask people or a driver for the measurement of a genome `(g,)`: the repetition waits for it, and holds nothing.

    Raises:
        RealityAwaited: always.
    """
    raise RealityAwaited(genome)
