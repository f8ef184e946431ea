"""Simulator tuning: the search for simulators that reproduce the real fitness of the samples."""

from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from services.core.arrays import Fitnesses, FloatArray, Parameters
from services.core.optimizers.base import Optimizer, maximise
from services.core.ports import Simulate
from services.core.types import Sample, Simulator, Space


def squared_errors(fitnesses: Fitnesses, measured: FloatArray) -> FloatArray:
    """Σ over samples of (f_sim − f_real)², `(m,)`; inf where the physics failed on one.

    Source: paper, section 2: the denominator of f(sim).

    Args:
        fitnesses: `(n, m)` of n samples in m simulators.
        measured: `(n,)` fitnesses in reality.
    """
    errors: FloatArray = ((fitnesses - measured[:, None]) ** 2).sum(axis=0)
    return np.where(np.isnan(errors), np.inf, errors)


def simulator_fitness(squared_error: FloatArray) -> FloatArray:
    """f(sim) = 1 / Σ e²; infinite at a perfect fit. Source: paper, section 2."""
    with np.errstate(divide="ignore"):
        return 1.0 / squared_error


def draw_simulators(space: Space, count: int, rng: Generator) -> tuple[Simulator, ...]:
    """Randomly configured simulators, which is what there is before the first sample. Source: paper, section 2."""
    return tuple(Simulator(parameters) for parameters in space.draw(count, rng))


def tune(
    simulate: Simulate,
    samples: Sequence[Sample],
    space: Space,
    optimizer: Optimizer,
    evaluations: int,
    rng: Generator,
) -> tuple[Simulator, ...]:
    """The final population of simulators, best first, after a search from scratch on all samples.

    −Σe² is what the optimizer maximises: it ranks simulators as f(sim) = 1/Σe² does, and is finite at a perfect fit.

    Args:
        simulate: fitness in simulation; asked for all samples at once.
        samples: at least one whose measurement succeeded.
        space: of the tunables.
        optimizer: that searches; a diverse one keeps an ensemble.
        evaluations: simulators to evaluate, each on every sample.
        rng: all randomness of the search.
    """
    genomes = np.array([each.genome for each in samples])
    measured = np.array([each.fitness for each in samples])

    def fitness(parameters: Parameters) -> FloatArray:
        return -squared_errors(simulate(genomes, parameters), measured)

    found = maximise(optimizer, space, fitness, evaluations, rng)
    return tuple(
        Simulator(parameters, float(-value)) for parameters, value in zip(found.genomes, found.fitness, strict=True)
    )
