"""Rules for the member that leaves a steady-state population after one joins."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from gaplab.services.core.arrays import FloatArray, Genome, Genomes
from gaplab.services.core.optimizers.base import Population

Replacement: TypeAlias = Callable[[Population], int]
"""A function from a population to the index of the member to drop."""

Bound: TypeAlias = Callable[[Population, Genome], float]
"""A function that returns the fitness below which a newcomer to a full population is itself dropped."""


def insert(
    population: Population, genomes: Genomes, fitness: FloatArray, size: int, replacement: Replacement
) -> Population:
    """Add newcomers in turn, and drop a member for each beyond `size`; return the population.

    Members keep their order, which is their age.
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
    """Return the least fit member; of equals, the oldest.

    Source: paper, section 2, [10].
    """
    return int(np.argmin(population.fitness))


def most_similar(population: Population) -> tuple[int, int]:
    """Return the pair with the most similar genomes, the older first.

    Similarity is Euclidean distance, with each coordinate in units of its extent, and the shorter way around in
    periodic coordinates.
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
    """Return the less fit member of the pair with the most similar genomes; of equals, the older.

    The fittest of all members never leaves.

    Source: paper, section 2, *Informative*.
    """
    older, newer = most_similar(population)
    return newer if population.fitness[newer] < population.fitness[older] else older


def bound_of_least_fit(population: Population, newcomer: Genome) -> float:  # noqa: ARG001 - as the other bound
    """Return the lowest fitness of all members: below it the newcomer is the least fit."""
    return float(population.fitness.min())


def bound_of_most_similar(population: Population, newcomer: Genome) -> float:
    """Return the fitness of the newcomer's partner in the most similar pair; -inf if the newcomer is not in that pair.

    A newcomer outside that pair stays at any fitness.
    """
    joined = Population(population.space, np.vstack([population.genomes, newcomer]), population.fitness)
    older, newer = most_similar(joined)
    return float(population.fitness[older]) if newer == population.size else -np.inf
