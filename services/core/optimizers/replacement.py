"""Which member leaves a steady-state population that has grown by one."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from gaplab.services.core.arrays import FloatArray, Genome, Genomes
from gaplab.services.core.optimizers.base import Population

Replacement: TypeAlias = Callable[[Population], int]
"""The index of the member to drop."""

Bound: TypeAlias = Callable[[Population, Genome], float]
"""The fitness below which a newcomer to a full population is itself the member to drop, whatever it is exactly."""


def insert(
    population: Population, genomes: Genomes, fitness: FloatArray, size: int, replacement: Replacement
) -> Population:
    """The population with each newcomer added in turn, and a member dropped for each beyond `size`.

    The members keep their order, so age stays readable from it.
    """
    for genome, value in zip(genomes, fitness, strict=True):
        population = Population(
            population.space, np.vstack([population.genomes, genome]), np.append(population.fitness, value)
        )
        if population.size > size:
            keep = np.arange(population.size) != replacement(population)
            population = Population(population.space, population.genomes[keep], population.fitness[keep])
    return population


def least_fit(population: Population) -> int:
    """The least fit member; of equals, the oldest.

    Source: paper, section 2, [10].
    """
    return int(np.argmin(population.fitness))


def most_similar(population: Population) -> tuple[int, int]:
    """The pair whose genomes are most similar, the older first.

    Similar means near in Euclidean distance, with each coordinate in units of its extent, and the shorter way around in
    those that wrap.
    """
    scaled = population.genomes / population.space.extent
    squares = np.einsum("ij,ij->i", scaled, scaled)
    distances = squares[:, None] + squares[None, :] - 2.0 * (scaled @ scaled.T)
    for phase in scaled.T[population.space.periodic]:
        apart = np.abs(phase[:, None] - phase)
        distances += np.minimum(apart, 1.0 - apart) ** 2 - apart**2
    np.fill_diagonal(distances, np.inf)
    first, second = divmod(int(np.argmin(distances)), len(scaled))
    return min(first, second), max(first, second)


def less_fit_of_most_similar(population: Population) -> int:
    """The less fit member of the pair whose genomes are most similar; of equals, the older.

    The fittest member of all never leaves.

    Source: paper, section 2, *Informative*.
    """
    older, newer = most_similar(population)
    return newer if population.fitness[newer] < population.fitness[older] else older


def bound_of_least_fit(population: Population, newcomer: Genome) -> float:  # noqa: ARG001 - as the other bound
    """The least fitness of all members: below it the newcomer is the least fit."""
    return float(population.fitness.min())


def bound_of_most_similar(population: Population, newcomer: Genome) -> float:
    """The fitness of the member that is most similar to the newcomer, if they are the most similar pair; else -inf.

    A newcomer that is not of that pair stays, however unfit it is.
    """
    joined = Population(population.space, np.vstack([population.genomes, newcomer]), population.fitness)
    older, newer = most_similar(joined)
    return float(population.fitness[older]) if newer == population.size else -np.inf
