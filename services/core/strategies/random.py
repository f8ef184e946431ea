"""Try anything."""

from numpy.random import Generator

from gaplab.services.core.arrays import Genome
from gaplab.services.core.strategies.base import Search, Strategy
from gaplab.services.core.types import Belief


class Random(Strategy):
    """A controller drawn uniformly.

    Selections are independent of each other, so the loop is not needed: k samples and one tuning would do. Here the
    k-th point of the curve is tuned on the first k samples, which is the same.
    """

    name = "random"
    source = "Paper, section 2, Random"
    searches = False

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """A genome, uniform over its space."""
        genome: Genome = belief.space.draw(1, rng)[0]
        return genome
