"""Try a controller that is expected to be fit and on which simulators disagree."""

from collections.abc import Mapping
from typing import Any, ClassVar

from numpy.random import Generator
from pydantic import Field

from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes
from gaplab.services.core.scoring import weighted_deviation, weighted_mean, weights_of
from gaplab.services.core.strategies.base import Diverse, DiverseOptions, Search, Weight
from gaplab.services.core.types import Belief


class SimulatedFitAndInformativeOptions(DiverseOptions):
    """Weights of fitness and disagreement; the paper uses a plain sum, and proposes a weighted one."""

    fit_weight: Weight = Field(default=1.0, description="weight of the mean simulated fitness")
    informative_weight: Weight = Field(default=1.0, description="weight of the standard deviation of simulated fitness")


class SimulatedFitAndInformative(Diverse):
    """The controller with high mean fitness in a diverse ensemble of simulators that disagree on it.

    The paper's most promising strategy: nearly perfect after one sample.
    """

    name = "simulated_fit_and_informative"
    source = "Paper, section 2, Simulated Fit and Informative; the weights: section 4"
    published: ClassVar[Mapping[str, Any]] = {"least_error": 0.0}
    Options = SimulatedFitAndInformativeOptions
    options: SimulatedFitAndInformativeOptions

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller with the highest sum of weighted mean and weighted deviation found."""
        belief = self.options.weighed(belief)
        weights = weights_of(belief.simulators, self.options.floor(belief))

        def score(_: Genomes, fitnesses: Fitnesses) -> FloatArray:
            fit = self.options.fit_weight * weighted_mean(fitnesses, weights)
            return fit + self.options.informative_weight * weighted_deviation(fitnesses, weights)

        return search(score, parameters=belief.parameters)
