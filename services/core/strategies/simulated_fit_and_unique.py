"""Try a controller that is fit in simulation and unlike earlier samples."""

from numpy.random import Generator

from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes
from gaplab.services.core.scoring import uniqueness_penalty
from gaplab.services.core.strategies.base import Search, Strategy
from gaplab.services.core.types import Belief


class SimulatedFitAndUnique(Strategy):
    """The fittest controller in the latest simulator, with a penalty for closeness to earlier samples.

    A cluster of samples teaches little more than one sample.
    """

    name = "simulated_fit_and_unique"
    source = "Paper, section 2, Simulated Fit and Unique"

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller with the highest f_sim(x) − 1/(100 N) Σ 1/d(x, y) found."""

        def score(genomes: Genomes, fitnesses: Fitnesses) -> FloatArray:
            fitness = fitnesses[:, 0]
            return fitness - uniqueness_penalty(genomes, fitness, belief.learnable)

        return search(score)
