"""Simulator tuning: the search for simulators that reproduce the real fitness of the samples."""

from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from gaplab.services.core.answers import Answers, Following
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genomes, Parameters
from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.search import Question, maximise
from gaplab.services.core.types import Sample, Simulator, Space

ROUNDING = 1e-9
"""Relative excess of a partial sum over a limit: from it on, the whole sum exceeds the limit in spite of rounding."""


def squared_errors(fitnesses: Fitnesses, measured: FloatArray) -> FloatArray:
    """Return Σ (f_sim − f_real)² over samples for each simulator, `(m,)`; inf where the physics failed on one.

    The samples are added one by one, so that the error of a simulator does not depend on the others in the call.

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
    """Return f(sim) = 1 / Σe²; infinite at a perfect fit. Source: paper, section 2."""
    with np.errstate(divide="ignore"):
        return 1.0 / squared_error


def draw_simulators(space: Space, count: int, rng: Generator) -> tuple[Simulator, ...]:
    """Return simulators drawn uniformly, for use before the first sample. Source: paper, section 2."""
    return tuple(Simulator(parameters) for parameters in space.draw(count, rng))


class Misfit:
    """−Σe² of simulators on samples; the sum stops as soon as it is certain to be below a threshold.

    The samples with the largest errors so far come first. The sum itself is in the order of the samples, and only the
    rollouts that were needed count. So no number, not even a count, depends on how many rollouts run at once.

    Args:
        answers: answers of the simulators.
        samples: at least one sample; all measurements succeeded.
    """

    def __init__(self, answers: Answers, samples: Sequence[Sample]) -> None:
        self._answers = answers
        self._genomes = np.array([sample.genome for sample in samples])
        self._measured = np.array([sample.fitness for sample in samples])
        self._erred = np.zeros(len(samples))
        self._asked = np.zeros(len(samples))

    def __call__(self, question: Question) -> FloatArray:
        """Return −Σe², `(m,)`, of simulators `(m, p)`; -inf where it is below the threshold."""
        simulators, thresholds = question.genomes, question.thresholds
        if np.all(np.isneginf(thresholds)):
            fitnesses = self._answers(self._genomes, simulators)
            for index, row in enumerate(fitnesses):
                self._learn(index, row)
            return -squared_errors(fitnesses, self._measured)
        return np.array([self._one(row[None, :], -least) for row, least in zip(simulators, thresholds, strict=True)])

    def _one(self, parameters: Parameters, limit: float) -> float:
        """Return −Σe² of one simulator `(1, p)`, or -inf if Σe² exceeds the limit."""
        fitnesses = np.empty((len(self._measured), 1))
        order = np.argsort(-self._erred / np.maximum(self._asked, 1.0), kind="stable")
        genomes, partial = self._genomes[order], 0.0
        for place, index in enumerate(order):
            one = genomes[place : place + 1]
            fitnesses[index] = self._answers(one, parameters, _first_of(genomes[place + 1 :]))
            partial += self._learn(int(index), fitnesses[index])
            if not partial <= limit * (1.0 + ROUNDING):
                return -np.inf
        return -float(squared_errors(fitnesses, self._measured)[0])

    def _learn(self, sample: int, fitnesses: FloatArray) -> float:
        """Remember how far simulators err on a sample, and return the sum of their squared errors."""
        squares = (fitnesses - self._measured[sample]) ** 2
        self._erred[sample] += np.nansum(squares)
        self._asked[sample] += len(squares)
        return float(squares.sum())


def _first_of(genomes: Genomes) -> Following:
    return lambda count: genomes[:count]


def tune(misfit: Misfit, space: Space, optimizer: Optimizer, evaluations: int, rng: Generator) -> tuple[Simulator, ...]:
    """Return the final population of simulators, best first, after a search from scratch.

    The optimizer maximises −Σe². It ranks simulators as f(sim) = 1/Σe² does, and is finite at a perfect fit.

    Args:
        misfit: misfit to the samples so far.
        space: bounds of the tunables.
        optimizer: optimizer of the search; a diverse one keeps an ensemble.
        evaluations: number of simulators to evaluate.
        rng: all randomness of the search.
    """
    found = maximise(optimizer, space, misfit, evaluations, rng)
    return tuple(
        Simulator(parameters, float(-value)) for parameters, value in zip(found.genomes, found.fitness, strict=True)
    )
