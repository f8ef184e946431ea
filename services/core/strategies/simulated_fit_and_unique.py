"""Try a controller that is fit in simulation and unlike earlier samples."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes
from gaplab.services.core.scoring import scaled_uniqueness_penalty, uniqueness_penalty
from gaplab.services.core.strategies.base import Search, Strategy
from gaplab.services.core.types import Belief


class SimulatedFitAndUniqueOptions(Frozen):
    """Options of `simulated_fit_and_unique`."""

    distances: Literal["scaled", "plain"] = Field(
        default="scaled",
        description="scaled: genes in units of their extents, fitness and penalty as shares of about the fitness of "
        "`direct`; plain: as in the paper, genes and fitness are added whatever their units",
    )


class SimulatedFitAndUnique(Strategy):
    """The fittest controller in the latest simulator, with a penalty for closeness to earlier samples.

    A cluster of samples teaches little more than one sample.
    """

    name = "simulated_fit_and_unique"
    source = "Paper, section 2, Simulated Fit and Unique; scaled distances are gaplab's"
    published: ClassVar[Mapping[str, Any]] = {"distances": "plain"}
    Options = SimulatedFitAndUniqueOptions
    options: SimulatedFitAndUniqueOptions

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller with the highest f_sim(x) − 1/(100 N) Σ 1/d(x, y) found."""
        scaled = self.options.distances == "scaled"

        def score(genomes: Genomes, fitnesses: Fitnesses) -> FloatArray:
            fitness = fitnesses[:, 0]
            if scaled:
                return fitness - scaled_uniqueness_penalty(genomes, fitness, belief)
            return fitness - uniqueness_penalty(genomes, fitness, belief.learnable)

        return search(score)
