"""MAP-Elites: the fittest genome of each kind of behaviour, in place of the fittest of all.

It is NumPy: pyribs would bring pandas, numba and scikit-learn for an archive that is a sort.
"""

from typing import Annotated

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Genomes
from gaplab.services.core.optimizers.base import Optimizer, Population
from gaplab.services.core.optimizers.steady_state import SteadyState, SteadyStateOptions

Count = Annotated[int, Field(strict=True, ge=1, le=10_000)]


class MapElitesOptions(Frozen):
    """Options of the optimizer `map_elites`."""

    bins: Annotated[int, Field(strict=True, ge=2, le=1_000)] = Field(
        default=5, description="cells along each number of a descriptor; the authors': 5"
    )
    first: Count = Field(
        default=20, description="genomes drawn uniformly at first; the authors' 200 are too many for small budgets"
    )
    batch: Count = Field(default=20, description="newcomers evaluated at once; the authors': 400")


class MapElites(Optimizer):
    """A map of behaviours: each cell keeps the fittest genome whose behaviour falls into it.

    It is for strategies whose score describes behaviour: `(n, 1 + d)`, fitness, then a descriptor of d numbers from 0
    to 1. The cell of a number x is the nearest of `bins` from 0 to 1. A newcomer has one parent, uniform over filled
    cells, and mutates as those of `steady_state`. Of the authors' release, the tie within 0.05 of fitness is left out,
    which has a unit. Do not use it to find one fittest controller or simulator: it spends most of its budget on other
    behaviours. Where only fitness is scored, the genes, as shares of their extents, are the descriptor; diverse
    simulators are those of `steady_state`.
    """

    name = "map_elites"
    source = "Mouret and Clune 2015; Cully et al. 2015, https://github.com/resibots/map_elites_hexapod"
    objectives = True
    Options = MapElitesOptions
    options: MapElitesOptions

    @property
    def least_evaluations(self) -> int:
        """Return the number of first genomes."""
        return self.options.first

    def ask(self, state: Population, rng: Generator) -> Genomes:
        """Return the first genomes, drawn uniformly; later, mutants of elites."""
        if not state.size:
            return state.space.draw(self.options.first, rng)
        variation = SteadyStateOptions(population=2, tournament=1, crossover=0.0, offspring=self.options.batch)
        return SteadyState(variation).ask(Population(state.space, state.genomes, _rows(state.fitness)[:, 0]), rng)

    def tell(self, state: Population, genomes: Genomes, fitness: FloatArray) -> Population:
        """Return the elites after learning the fitness `(n,)` or `(n, 1 + d)` of genomes; of equals, the older stays.

        Genomes whose physics failed are in no cell as long as another's did not.
        """
        genomes = np.vstack([state.genomes, genomes])
        fitness = np.concatenate([state.fitness, fitness]) if state.size else fitness
        fittest = _rows(fitness)[:, 0]
        shares = _rows(fitness)[:, 1:] if fitness.ndim > 1 else (genomes - state.space.lower) / state.space.extent
        cells = np.rint(np.clip(shares, 0.0, 1.0) * (self.options.bins - 1))
        order = np.argsort(-fittest, kind="stable")
        _, firsts = np.unique(cells[order], axis=0, return_index=True)
        kept = np.sort(order[firsts])
        works = kept[fittest[kept] > -np.inf]
        kept = works if len(works) else kept
        return Population(state.space, genomes[kept], fitness[kept])

    def diverse(self, size: int) -> Optimizer:
        """Return the diverse evolution of `steady_state`, since nothing describes a simulator."""
        return SteadyState().diverse(size)


def _rows(fitness: FloatArray) -> FloatArray:
    return fitness.reshape(len(fitness), -1)
