"""Try a random controller."""

from numpy.random import Generator

from gaplab.services.core.arrays import Genome
from gaplab.services.core.strategies.base import Search, Strategy
from gaplab.services.core.types import Belief


class Random(Strategy):
    """A controller drawn uniformly.

    Selections are independent, so k samples and one tuning would suffice. Here the k-th point of the curve is tuned on
    the first k samples, which is equivalent.
    """

    name = "random"
    source = "Paper, section 2, Random"
    searches = False

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return a genome, uniform over its space."""
        genome: Genome = belief.space.draw(1, rng)[0]
        return genome
