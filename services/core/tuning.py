"""Simulator tuning: the search for simulators that reproduce the real fitness of the samples."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from services.core.arrays import Fitnesses, FloatArray, Parameters
from services.core.optimizers.base import Optimizer, maximise
from services.core.ports import Simulate
from services.core.types import Sample, Simulator, Space

ROUNDING = 1e-9
"""By how much a partial sum must exceed a limit, relatively, for the whole to exceed it whatever the rounding."""

Selection: TypeAlias = slice | NDArray[np.intp]
"""Which samples: all, or these."""


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

    The samples on which simulators have erred most so far are asked first, a batch at a time; what the errors add up
    to is added in the samples' own order, so nothing that is known exactly depends on the order of asking.

    Args:
        simulate: fitness in simulation.
        samples: at least one, whose measurement succeeded.
        batch: how many to ask at a time for a simulator that may be given up; no number depends on it.
    """

    def __init__(self, simulate: Simulate, samples: Sequence[Sample], batch: int = 1) -> None:
        self._simulate = simulate
        self._batch = batch
        self._genomes = np.array([each.genome for each in samples])
        self._measured = np.array([each.fitness for each in samples])
        self._erred = np.zeros(len(samples))
        self._asked = np.zeros(len(samples))

    def __call__(self, parameters: Parameters, bounds: FloatArray) -> FloatArray:
        """`(m, p)` simulators, `(m,)` bounds -> `(m,)` of −Σe²; -inf for what is below its bound."""
        if np.all(np.isneginf(bounds)) or self._batch >= len(self._measured):
            return -self._errors(slice(None), parameters, np.zeros((len(self._measured), len(parameters))))
        return np.array([self._one(row, -bound) for row, bound in zip(parameters, bounds, strict=True)])

    def _one(self, parameters: FloatArray, limit: float) -> float:
        known = np.zeros((len(self._measured), 1))
        order = np.argsort(-self._erred / np.maximum(self._asked, 1.0), kind="stable")
        for begin in range(0, len(order), self._batch):
            error = self._errors(order[begin : begin + self._batch], parameters[None, :], known)[0]
            if error > limit * (1.0 + ROUNDING):
                return -np.inf
        return -float(error)

    def _errors(self, which: Selection, parameters: Parameters, known: FloatArray) -> FloatArray:
        """Σe² over the samples asked so far and these, `(m,)`; `known` keeps fitnesses minus measurements."""
        fitnesses = self._simulate(self._genomes[which], parameters)
        known[which] = fitnesses - self._measured[which][:, None]
        self._erred[which] += np.nan_to_num(known[which] ** 2).sum(axis=1)
        self._asked[which] += fitnesses.shape[1]
        return squared_errors(known, np.zeros(len(known)))


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
