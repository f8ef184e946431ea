"""Try what a repertoire promises, and learn on the way how far each kind of behaviour keeps its promise."""

from typing import Annotated, ClassVar

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Genome, Genomes, Outcomes
from gaplab.services.core.gaussian_process import GaussianProcess
from gaplab.services.core.registry import Presets
from gaplab.services.core.space import Space
from gaplab.services.core.strategies.base import Score, Search, Strategy
from gaplab.services.core.types import Belief

Positive = Annotated[float, Field(strict=True, gt=0, le=1_000)]


class IntelligentTrialAndErrorOptions(Frozen):
    """Options of the strategy `intelligent_trial_and_error`; the authors' are those of their release of 2015."""

    length_scale: Positive = Field(
        default=0.4, description="length of the Matérn-5/2 kernel between descriptors; the authors': 0.4"
    )
    noise: Positive = Field(
        default=0.001, description="variance of a measurement, as a share of the process's; the authors': 0.001"
    )
    alpha: Annotated[float, Field(strict=True, ge=0, le=1_000)] = Field(
        default=0.05,
        description="standard deviations that are added to a prediction, each as large as about the fitness of "
        "`direct`; the authors': 0.05, each of 1 in the unit of fitness",
    )
    stop_ratio: Annotated[float, Field(strict=True, ge=0, le=1)] | None = Field(
        default=0.9,
        description="share of the best prediction: once the best measured exceeds it, it is tried again and again; the "
        "authors stop there: 0.9; null: never",
    )
    described: Annotated[int, Field(strict=True, ge=1, le=100)] = Field(
        default=2,
        description="so many sensors, the first ones, describe a behaviour, each by the shares of time in which it is "
        "above and below 0 by more than its noise; gaplab's: 2, for the task walk roll and pitch; with four contacts "
        "alone: 4",
    )


class IntelligentTrialAndError(Strategy):
    """A repertoire of behaviours from one untuned simulator, and a model of how reality differs over behaviours.

    The model is a Gaussian process of real less simulated fitness over descriptors. The controller with the highest
    prediction plus a share of its uncertainty is tried; that with the highest prediction is transferred. The repertoire
    is made once, and its members are simulated again in each selection and transfer: the fittest, as far as the budget
    goes. The authors describe a gait by how long each foot is on the ground, as a task does whose sensors are contacts;
    by default it is how long the first sensors are above and below 0, like tilts of the trunk, or the genes of a robot
    without sensors. Do not use it where tuning can repair the simulator, or where genes are many and nothing else
    describes behaviour.
    """

    name = "intelligent_trial_and_error"
    source = "Cully et al. 2015; constants: their release of 2015, https://github.com/resibots/ITE"
    presets: ClassVar[Presets] = {
        "cully_2015": {"length_scale": 0.4, "noise": 0.001, "alpha": 0.05, "stop_ratio": 0.9, "described": 4},
    }
    tunes = False
    continues = True
    controller_optimizer = "map_elites"
    Options = IntelligentTrialAndErrorOptions
    options: IntelligentTrialAndErrorOptions

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller with the highest upper confidence bound; the best one measured once that suffices.

        A controller whose measurement failed is not tried again.
        """

        def score(genomes: Genomes, outcomes: Outcomes) -> FloatArray:
            mean, deviation = self._predicted(belief, genomes, outcomes)
            best = max(belief.learnable, key=lambda each: each.fitness, default=None)
            if best is not None and self._suffices(best.fitness, float(np.nanmax(mean, initial=-np.inf))):
                return np.asarray((genomes == best.genome).all(axis=1), dtype=np.float64)
            failed = {each.genome.tobytes() for each in belief.samples if not np.isfinite(each.fitness)}
            bound = mean + self.options.alpha * belief.scale * deviation
            return np.where([each.tobytes() in failed for each in genomes], np.nan, bound)

        return self._search(belief, search, score)

    def transfer(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller with the highest prediction; of a new repertoire, the fittest in simulation."""
        return self._search(belief, search, lambda genomes, outcomes: self._predicted(belief, genomes, outcomes)[0])

    def _suffices(self, measured: float, predicted: float) -> bool:
        ratio = self.options.stop_ratio
        return ratio is not None and measured > predicted - (1.0 - ratio) * abs(predicted)

    def _search(self, belief: Belief, search: Search, score: Score) -> Genome:
        """Return the best of samples and repertoire by a score; without a repertoire, make one, and return its best."""

        def promised(_: Genomes, outcomes: Outcomes) -> FloatArray:
            fitness = outcomes[:, 0, 0]
            return np.column_stack([fitness, self._described(belief, outcomes)]) if outcomes.shape[2] > 1 else fitness

        simulator = belief.parameters[:1]
        if not len(belief.members):
            return search(promised, parameters=simulator, senses=True)
        known = {each.tobytes(): each for each in (*(one.genome for one in belief.samples), *belief.members)}
        return search(score, parameters=simulator, senses=True, candidates=np.array(list(known.values())))

    def _described(self, belief: Belief, outcomes: Outcomes) -> FloatArray:
        """Return `(n, 2 s)`: shares of time that each of s sensors is above 0 by more than its noise, and below."""
        times_s, readings = belief.reading_times_s, outcomes[:, 0, 1:]
        sensors = np.count_nonzero(times_s == times_s[0]) if times_s.size else readings.shape[1]
        values = readings.reshape(len(readings), -1, sensors)[:, :, : self.options.described]
        return np.hstack([(values > 1.0).mean(axis=1), (values < -1.0).mean(axis=1)])

    def _predicted(self, belief: Belief, genomes: Genomes, outcomes: Outcomes) -> tuple[FloatArray, FloatArray]:
        """Return expected fitness in reality, `(n,)`, and its deviation, `(n,)`, 1 where nothing is known.

        Samples that are not among the genomes, or whose simulation failed, teach nothing.
        """
        fitness = outcomes[:, 0, 0]
        places = {genome.tobytes(): place for place, genome in enumerate(genomes) if np.isfinite(fitness[place])}
        learned = [(places.get(each.genome.tobytes()), each.fitness) for each in belief.learnable]
        tried = [(place, real) for place, real in learned if place is not None]
        if not tried:
            return fitness, np.ones(len(fitness))
        space, points = belief.space, genomes
        if outcomes.shape[2] > 1:
            points = self._described(belief, outcomes)
            space = Space.box([0.0] * points.shape[1], [1.0] * points.shape[1])
        at, real = [place for place, _ in tried], np.array([each for _, each in tried])
        process = GaussianProcess("matern52", self.options.length_scale, self.options.noise, mean=0.0, variance=1.0)
        differences, deviation = process.given(space, points[at], real - fitness[at]).predict(points)
        return fitness + differences, deviation
