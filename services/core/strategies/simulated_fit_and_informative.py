"""Try what is expected to be fit and what the simulators disagree about."""

from typing import Annotated

from numpy.random import Generator
from pydantic import Field

from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes
from gaplab.services.core.scoring import simulator_weights, weighted_deviation, weighted_mean
from gaplab.services.core.strategies.base import EnsembleOptions, Search, Strategy
from gaplab.services.core.types import Belief

Weight = Annotated[float, Field(strict=True, ge=0, le=1e6)]


class SimulatedFitAndInformativeOptions(EnsembleOptions):
    """Options of the mixture: the paper's is a plain sum, and it proposes the weighted one."""

    fit_weight: Weight = Field(default=1.0, description="of the weighted mean of the simulated fitnesses")
    informative_weight: Weight = Field(default=1.0, description="of their weighted standard deviation")


class SimulatedFitAndInformative(Strategy):
    """The controller whose simulated fitness is high on average over a diverse ensemble, and disputed within it.

    The paper's most promising strategy: nearly perfect after one sample.
    """

    name = "simulated_fit_and_informative"
    source = "Paper, section 2, Simulated Fit and Informative; the weights: section 4"
    Options = SimulatedFitAndInformativeOptions
    options: SimulatedFitAndInformativeOptions

    @property
    def ensemble(self) -> int:
        """The diverse ensemble."""
        return self.options.simulators

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """The controller found that maximises the sum of weighted mean and weighted deviation."""
        weights = simulator_weights(belief.squared_errors, self.options.least_error**2)

        def score(_: Genomes, fitnesses: Fitnesses) -> FloatArray:
            fit = self.options.fit_weight * weighted_mean(fitnesses, weights)
            return fit + self.options.informative_weight * weighted_deviation(fitnesses, weights)

        return search(score)
