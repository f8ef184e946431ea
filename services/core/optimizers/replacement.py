"""Which member leaves a steady-state population that has grown by one."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from services.core.optimizers.base import Population

Replacement: TypeAlias = Callable[[Population], int]
"""The index of the member to drop."""


def least_fit(population: Population) -> int:
    """The least fit member; of equals, the oldest.

    Source: paper, section 2, [10].
    """
    return int(np.argmin(population.fitness))


def less_fit_of_most_similar(population: Population) -> int:
    """The less fit member of the pair whose genomes are most similar; of equals, the older.

    Similar means near in Euclidean distance, with each coordinate in units of its extent. The fittest member of all
    never leaves.

    Source: paper, section 2, *Informative*.
    """
    scaled = population.genomes / population.space.extent
    squares = np.einsum("ij,ij->i", scaled, scaled)
    distances = squares[:, None] + squares[None, :] - 2.0 * (scaled @ scaled.T)
    np.fill_diagonal(distances, np.inf)
    first, second = divmod(int(np.argmin(distances)), population.size)
    older, newer = min(first, second), max(first, second)
    return newer if population.fitness[newer] < population.fitness[older] else older
