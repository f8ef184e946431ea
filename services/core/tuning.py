"""Simulator tuning: the search for simulators that reproduce the real fitness of the samples."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.random import Generator

from gaplab.services.core.arrays import Fitnesses, FloatArray, Parameters
from gaplab.services.core.counted import Count
from gaplab.services.core.optimizers.base import Optimizer, maximise
from gaplab.services.core.ports import Simulate
from gaplab.services.core.types import Sample, Simulator, Space

ROUNDING = 1e-9
"""By how much a partial sum must exceed a limit, relatively, for the whole to exceed it whatever the rounding."""


def squared_errors(fitnesses: Fitnesses, measured: FloatArray) -> FloatArray:
    """Σ over samples of (f_sim − f_real)², `(m,)`; inf where the physics failed on one.

    The samples are added one after the other, so that a simulator's error does not depend on how many others are asked
    for at once.

    Source: paper, section 2: the denominator of f(sim).

    Args:
        fitnesses: `(n, m)` of n samples in m simulators.
        measured: `(n,)` fitnesses in reality.
    """
    errors = np.zeros(fitnesses.shape[1])
    for row in (fitnesses - measured[:, None]) ** 2:
        errors = errors + row
    return np.where(np.isnan(errors), np.inf, errors)


def simulator_fitness(squared_error: FloatArray) -> FloatArray:
    """f(sim) = 1 / Σ e²; infinite at a perfect fit. Source: paper, section 2."""
    with np.errstate(divide="ignore"):
        return 1.0 / squared_error


def draw_simulators(space: Space, count: int, rng: Generator) -> tuple[Simulator, ...]:
    """Randomly configured simulators, which is what there is before the first sample. Source: paper, section 2."""
    return tuple(Simulator(parameters) for parameters in space.draw(count, rng))


class Misfit:
    """−Σe² of simulators on samples, given up as soon as it is sure to be below a bound.

    The samples on which simulators have erred most so far are asked first. What the errors add up to is added in the
    samples' own order, and what was asked in vain, because it was asked together with what settled the matter, counts
    for nothing: no number, not even a count, depends on how many samples are asked at a time.

    Args:
        simulate: fitness in simulation.
        samples: at least one, whose measurement succeeded.
        batch: how many to ask at a time for a simulator that may be given up.

    Attributes:
        count: of the rollouts that were needed.
    """

    def __init__(self, simulate: Simulate, samples: Sequence[Sample], batch: Callable[[], int] = lambda: 1) -> None:
        self.count = Count()
        self._simulate = simulate
        self._batch = batch
        self._genomes = np.array([each.genome for each in samples])
        self._measured = np.array([each.fitness for each in samples])
        self._erred = np.zeros(len(samples))
        self._asked = np.zeros(len(samples))

    def __call__(self, parameters: Parameters, bounds: FloatArray) -> FloatArray:
        """`(m, p)` simulators, `(m,)` bounds -> `(m,)` of −Σe²; -inf for what is below its bound."""
        if np.all(np.isneginf(bounds)):
            fitnesses = self._simulate(self._genomes, parameters)
            for index, row in enumerate(fitnesses):
                self._learn(index, row)
            return -squared_errors(fitnesses, self._measured)
        return np.array([self._one(row[None, :], -bound) for row, bound in zip(parameters, bounds, strict=True)])

    def _one(self, parameters: Parameters, limit: float) -> float:
        """−Σe² of one simulator `(1, p)`, or -inf if Σe² exceeds the limit."""
        fitnesses = np.empty((len(self._measured), 1))
        order = np.argsort(-self._erred / np.maximum(self._asked, 1.0), kind="stable")
        batch, partial = self._batch(), 0.0
        for place, index in enumerate(order):
            if place % batch == 0:
                together = order[place : place + batch]
                fitnesses[together] = self._simulate(self._genomes[together], parameters)
            partial += self._learn(int(index), fitnesses[index])
            if not partial <= limit * (1.0 + ROUNDING):
                return -np.inf
        return -float(squared_errors(fitnesses, self._measured)[0])

    def _learn(self, sample: int, fitnesses: FloatArray) -> float:
        """Count rollouts of a sample, remember how far they erred, and give the sum of their squared errors."""
        self.count.add(fitnesses)
        squares = (fitnesses - self._measured[sample]) ** 2
        self._erred[sample] += np.nansum(squares)
        self._asked[sample] += len(squares)
        return float(squares.sum())


def tune(misfit: Misfit, space: Space, optimizer: Optimizer, evaluations: int, rng: Generator) -> tuple[Simulator, ...]:
    """The final population of simulators, best first, after a search from scratch.

    −Σe² is what the optimizer maximises: it ranks simulators as f(sim) = 1/Σe² does, and is finite at a perfect fit.

    Args:
        misfit: to the samples so far.
        space: of the tunables.
        optimizer: that searches; a diverse one keeps an ensemble.
        evaluations: simulators to evaluate.
        rng: all randomness of the search.
    """
    found = maximise(optimizer, space, misfit, evaluations, rng)
    return tuple(
        Simulator(parameters, float(-value)) for parameters, value in zip(found.genomes, found.fitness, strict=True)
    )
