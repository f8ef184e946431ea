"""Try what the simulators disagree about."""

from numpy.random import Generator

from gaplab.services.core.arrays import Genome
from gaplab.services.core.scoring import simulator_weights, weighted_deviation
from gaplab.services.core.strategies.base import EnsembleOptions, Search, Strategy
from gaplab.services.core.types import Belief


class Informative(Strategy):
    """The controller whose fitness a diverse ensemble of simulators disagrees about most.

    The disagreement is a standard deviation, in which accurate simulators weigh more.
    """

    name = "informative"
    source = "Paper, section 2, Informative; Estimation-Exploration"
    Options = EnsembleOptions
    options: EnsembleOptions

    @property
    def ensemble(self) -> int:
        """The diverse ensemble."""
        return self.options.simulators

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """The controller found that maximises the weighted deviation of its simulated fitnesses."""
        weights = simulator_weights(belief.squared_errors, self.options.least_error**2)
        return search(lambda _, fitnesses: weighted_deviation(fitnesses, weights))
