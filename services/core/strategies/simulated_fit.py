"""Try the controller that is fittest in simulation."""

from numpy.random import Generator

from gaplab.services.core.arrays import Genome
from gaplab.services.core.strategies.base import Search, Strategy
from gaplab.services.core.types import Belief


class SimulatedFit(Strategy):
    """The controller that is fittest in the latest tuned simulator.

    The simulator needs to be right only about fit controllers, so samples are biased towards them.
    """

    name = "simulated_fit"
    source = "Paper, section 2, Simulated Fit; Back-to-Reality and Estimation-Exploration"
    selects_transferred = True

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the fittest controller found in the best simulator."""
        return search(lambda _, fitnesses: fitnesses[:, 0])
