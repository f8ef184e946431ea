"""Try a controller on which the simulators disagree."""

from collections.abc import Mapping
from typing import Any, ClassVar

from numpy.random import Generator

from gaplab.services.core.arrays import Genome
from gaplab.services.core.scoring import weighted_deviation, weights_of
from gaplab.services.core.strategies.base import Diverse, Search
from gaplab.services.core.types import Belief


class Informative(Diverse):
    """The controller on whose fitness a diverse ensemble of simulators disagrees most.

    Disagreement is the standard deviation, weighted by the accuracy of simulators.
    """

    name = "informative"
    source = "Paper, section 2, Informative; Estimation-Exploration"
    published: ClassVar[Mapping[str, Any]] = {"least_error": 0.0}

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller with the highest weighted deviation of simulated fitness found."""
        belief = self.options.weighed(belief)
        weights = weights_of(belief.simulators, self.options.floor(belief))
        return search(lambda _, fitnesses: weighted_deviation(fitnesses, weights), parameters=belief.parameters)
