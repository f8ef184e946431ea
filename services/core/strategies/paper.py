"""The paper's strategies, and the baseline of all comparisons.

Source: paper, section 2.
"""

from typing import Annotated, ClassVar, Literal

from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes
from gaplab.services.core.registry import Presets
from gaplab.services.core.scoring import (
    deviation_of_readings,
    scaled_uniqueness_penalty,
    uniqueness_penalty,
    weighted_deviation,
    weighted_mean,
    weights_of,
)
from gaplab.services.core.strategies.base import Diverse, DiverseOptions, Search, Strategy, Weight
from gaplab.services.core.types import Belief


class Random(Strategy):
    """A controller drawn uniformly.

    Selections are independent, so k samples and one tuning would suffice. Here the k-th point of the curve is tuned on
    the first k samples, which is equivalent.
    """

    name = "random"
    source = "Paper, section 2, Random"
    searches = False
    needs_fitness = False

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return a genome, uniform over its space, or over the recordings that are left."""
        genome: Genome = belief.draw(1, rng)[0]
        return genome


class KnownFitOptions(Frozen):
    """Options of the strategy `known_fit`."""

    spread: Annotated[float, Field(strict=True, gt=0, le=1)] = Field(
        default=0.25,
        description="upper end of the uniform number from 0 that is added to each gene, as a share of its extent",
    )


class KnownFit(Strategy):
    """The robot's hand-designed controller with a uniform random number added to each gene.

    Like *random*, it needs no loop. Its samples have medium fitness, while most random ones are unfit.
    """

    name = "known_fit"
    source = "Paper, section 2, Known Fit"
    searches = False
    Options = KnownFitOptions
    options: KnownFitOptions

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the known genome plus U[0, spread] on each gene; phases wrap, widths clip."""
        space = belief.space
        return space.contain(belief.known + self.options.spread * space.extent * rng.random(space.size))


class Informative(Diverse):
    """The controller on whose fitness a diverse ensemble of simulators disagrees most.

    Disagreement is the standard deviation, weighted by the accuracy of simulators. Of recordings, which have no
    fitness, it is that of all readings.
    """

    name = "informative"
    source = "Paper, section 2, Informative; Estimation-Exploration"
    presets: ClassVar[Presets] = {**Diverse.presets, "as_published": {"least_error": 0.0}}
    needs_fitness = False

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller with the highest weighted deviation of simulated fitness, or of readings, found."""
        belief = self.options.weighed(belief)
        weights = weights_of(belief.simulators, self.options.floor(belief))
        if belief.candidates is not None:
            return search(
                lambda _, outcomes: deviation_of_readings(outcomes[..., 1:], weights),
                parameters=belief.parameters,
                senses=True,
            )
        return search(lambda _, fitnesses: weighted_deviation(fitnesses, weights), parameters=belief.parameters)


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


class SimulatedFitAndInformativeOptions(DiverseOptions):
    """Weights of fitness and disagreement; the paper uses a plain sum, and proposes a weighted one."""

    fit_weight: Weight = Field(default=1.0, description="weight of the mean simulated fitness")
    informative_weight: Weight = Field(default=1.0, description="weight of the standard deviation of simulated fitness")

    def score(self, fitnesses: Fitnesses, weights: FloatArray) -> FloatArray:
        """Return the sum of weighted mean and weighted deviation of fitnesses `(n, m)`, given weights `(m,)`."""
        fit = self.fit_weight * weighted_mean(fitnesses, weights)
        return fit + self.informative_weight * weighted_deviation(fitnesses, weights)


class SimulatedFitAndInformative(Diverse):
    """The controller with high mean fitness in a diverse ensemble of simulators that disagree on it.

    The paper's most promising strategy: nearly perfect after one sample.
    """

    name = "simulated_fit_and_informative"
    source = "Paper, section 2, Simulated Fit and Informative; the weights: section 4"
    presets: ClassVar[Presets] = {**Diverse.presets, "as_published": {"least_error": 0.0}}
    Options = SimulatedFitAndInformativeOptions
    options: SimulatedFitAndInformativeOptions

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller with the highest sum of weighted mean and weighted deviation found."""
        belief = self.options.weighed(belief)
        weights = weights_of(belief.simulators, self.options.floor(belief))
        return search(lambda _, fitnesses: self.options.score(fitnesses, weights), parameters=belief.parameters)


class SimulatedFitAndUniqueOptions(Frozen):
    """Options of the strategy `simulated_fit_and_unique`."""

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
    presets: ClassVar[Presets] = {"as_published": {"distances": "plain"}}
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


class Direct(SimulatedFit):
    """Evolution in reality itself: the fitness that a perfect simulator would give.

    It takes no samples and tunes nothing; each of its evaluations would be a real one. An experiment of this strategy
    is iteration 0 of the algorithm, with reality as the simulator.
    """

    name = "direct"
    source = "Paper, section 3: 1.33 on average, standard deviation 0.10"
    takes_samples = False
    in_reality = True
