"""Let simulators and controllers evolve in turn, each from where its evolution stopped."""

from typing import Annotated

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes
from gaplab.services.core.scoring import weighted_mean, weights_of
from gaplab.services.core.strategies.base import Diverse, Search
from gaplab.services.core.strategies.paper import SimulatedFitAndInformativeOptions
from gaplab.services.core.types import Belief


class InterleavedOptions(SimulatedFitAndInformativeOptions):
    """Options of the strategy `interleaved`."""

    best: Annotated[int, Field(strict=True, ge=1, le=1_000)] = Field(
        default=10,
        description="best controllers, whose simulated fitness says which simulators are similar; gaplab's default",
    )
    alike: Annotated[float, Field(strict=True, gt=0, le=1_000)] = Field(
        default=0.1,
        description="difference of their fitness from which simulators are not similar at all, as a share of about the "
        "fitness of `direct`; gaplab's default",
    )


class Interleaved(Diverse):
    """Simulated fit and informative, where simulators and controllers evolve in turn and never start again.

    A search of controllers begins with the last one's final population. So a turn may have few evaluations, like
    100 of controllers and 50 of simulators. The tuner must go on too: `search` with its `warm_start`. A turn is an
    iteration, so each ends with a measurement.

    Simulators are similar if they predict alike for the ten best controllers of a search's first population, whatever
    their parameters. Similar ones share their weight, so that many of a kind count no more than one. Do not use it to
    reproduce the paper's figure, whose searches start anew, or where simulation costs nothing.
    """

    name = "interleaved"
    source = (
        "Paper, section 4, future work: interleaving, and similarity by predictions; shared weights: Goldberg and "
        "Richardson 1987; the numbers are gaplab's"
    )
    continues = True
    Options = InterleavedOptions
    options: InterleavedOptions

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller with the highest sum of mean and deviation found, in simulators that share weights."""
        options, scale, belief = self.options, belief.scale, self.options.weighed(belief)
        weights: list[FloatArray] = []

        def score(_: Genomes, fitnesses: Fitnesses) -> FloatArray:
            if not weights:
                accurate = weights_of(belief.simulators, options.floor(belief))
                weights.append(shared(accurate, fitnesses, options.best, options.alike * scale))
            return options.score(fitnesses, weights[0])

        return search(score, parameters=belief.parameters, start=belief.members)

    def transfer(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the fittest controller found in the best simulator, from the last population on."""
        return search(lambda _, fitnesses: fitnesses[:, 0], parameters=belief.parameters[:1], start=belief.members)


def shared(weights: FloatArray, fitnesses: Fitnesses, count: int, apart: float) -> FloatArray:
    """Return weights `(m,)` with sum 1 of simulators, each divided by how many are similar to it, itself included.

    Args:
        weights: `(m,)`, non-negative, summing to 1.
        fitnesses: `(n, m)` of n controllers; a simulator whose physics fails on one of the best is similar to none.
        count: number of best controllers, by weighted mean, that are compared.
        apart: root mean square difference of their fitness from which simulators are not similar at all.
    """
    means = weighted_mean(fitnesses, weights)
    best = fitnesses[np.argsort(-np.where(np.isnan(means), -np.inf, means), kind="stable")[:count]]
    away = np.sqrt(((best[:, :, None] - best[:, None, :]) ** 2).mean(axis=0))
    similar = np.nan_to_num(np.maximum(0.0, 1.0 - away / apart))
    np.fill_diagonal(similar, 1.0)
    found = weights / similar.sum(axis=1)
    return np.asarray(found / found.sum())
