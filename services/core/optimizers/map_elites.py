"""MAP-Elites: the fittest genome of each kind of behaviour, in place of the fittest of all.

It is NumPy: pyribs would bring pandas, numba and scikit-learn for an archive that is a sort.
"""

from typing import Annotated, ClassVar

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Genomes
from gaplab.services.core.optimizers.base import Optimizer, Population
from gaplab.services.core.optimizers.steady_state import SteadyState, SteadyStateOptions
from gaplab.services.core.registry import Presets


class MapElitesOptions(Frozen):
    """Options of the optimizer `map_elites`."""

    bins: Annotated[int, Field(strict=True, ge=2, le=1_000)] = Field(
        default=5, description="cells along each number of a descriptor; the authors': 5"
    )
    population: Annotated[int, Field(strict=True, ge=1, le=10_000)] = Field(
        default=20,
        description="genomes drawn uniformly at first, and newcomers at once; gaplab's: 20; published: 200, and 400",
    )


class MapElites(Optimizer):
    """A map of behaviours: each cell keeps the fittest genome whose behaviour falls into it.

    It is for strategies whose score describes behaviour: `(n, 1 + d)`, fitness, then a descriptor of d numbers from 0
    to 1. The cell of a number x is the nearest of `bins` from 0 to 1. A newcomer has one parent, uniform over filled
    cells, and mutates as those of `steady_state`. In the authors' release, a newcomer nearer to the middle of its cell
    replaces an elite that is up to 0.05 fitter; that is left out, since fitness has other units here. Do not use it to
    find one fittest controller or simulator: it spends most of its budget on other behaviours. Where only fitness is
    scored, the genes, as shares of their extents, are the descriptor; diverse simulators are those of `steady_state`.
    """

    name = "map_elites"
    source = "Mouret and Clune 2015; Cully et al. 2015, https://github.com/resibots/map_elites_hexapod"
    presets: ClassVar[Presets] = {"as_published": {"population": 200}}
    objectives = True
    Options = MapElitesOptions
    options: MapElitesOptions

    @property
    def least_evaluations(self) -> int:
        """Return the number of first genomes."""
        return self.options.population

    def ask(self, state: Population, rng: Generator) -> Genomes:
        """Return the first genomes, drawn uniformly; later, mutants of elites."""
        if not state.size:
            return state.space.draw(self.options.population, rng)
        variation = SteadyStateOptions(population=2, tournament=1, crossover=0.0, offspring=self.options.population)
        parents = np.resize(np.arange(state.size), max(state.size, variation.population))
        return SteadyState(variation).ask(Population(state.space, state.genomes[parents], state.first[parents]), rng)

    def tell(self, state: Population, genomes: Genomes, fitness: FloatArray) -> Population:
        """Return the elites after learning the fitness `(n,)` or `(n, 1 + d)` of genomes; of equals, the older stays.

        A genome whose physics failed is in no cell as long as another's did not.
        """
        if state.size:
            genomes, fitness = np.vstack([state.genomes, genomes]), np.concatenate([state.fitness, fitness])
        told = Population(state.space, genomes, fitness)
        shares = fitness[:, 1:] if fitness.ndim > 1 else (genomes - state.space.lower) / state.space.extent
        cells = np.rint(np.clip(shares, 0.0, 1.0) * (self.options.bins - 1))
        order = np.argsort(-told.first, kind="stable")
        _, fittest = np.unique(cells[order], axis=0, return_index=True)
        elites = np.sort(order[fittest])
        alive = elites[told.first[elites] > -np.inf]
        kept = alive if len(alive) else elites
        return Population(state.space, genomes[kept], fitness[kept])

    def diverse(self, size: int) -> Optimizer:
        """Return the diverse evolution of `steady_state`, since nothing describes a simulator."""
        return SteadyState().diverse(size)
