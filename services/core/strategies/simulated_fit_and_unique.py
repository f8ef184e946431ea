"""Try what is fit in simulation and unlike what was tried."""

from numpy.random import Generator

from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes
from gaplab.services.core.scoring import uniqueness_penalty
from gaplab.services.core.strategies.base import Search, Strategy
from gaplab.services.core.types import Belief


class SimulatedFitAndUnique(Strategy):
    """The controller that is fittest in the latest simulator, less a penalty for being near earlier samples.

    Several tightly clustered samples would teach little more than one.
    """

    name = "simulated_fit_and_unique"
    source = "Paper, section 2, Simulated Fit and Unique"

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """The controller found that maximises f_sim(x) − 1/(100 N) Σ 1/d(x, y)."""

        def score(genomes: Genomes, fitnesses: Fitnesses) -> FloatArray:
            fitness = fitnesses[:, 0]
            return fitness - uniqueness_penalty(genomes, fitness, belief.learnable)

        return search(score)
