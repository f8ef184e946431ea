"""Covariance matrix adaptation: a search that learns correlations between genes."""

from copy import deepcopy
from dataclasses import dataclass
from importlib import import_module
from typing import Annotated, Any

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Genome, Genomes
from gaplab.services.core.optimizers.base import Optimizer, Population
from gaplab.services.core.optimizers.steady_state import insert, least_fit, less_fit_of_most_similar
from gaplab.services.core.space import Space

CONVERGED = 1e-4
"""Share of each gene's extent at which a search has converged, and restarts."""


class CmaEsOptions(Frozen):
    """The options of CMA-ES; the defaults are its authors'."""

    population: Annotated[int, Field(strict=True, ge=4, le=10_000)] | None = Field(
        default=None, description="genomes of a generation; default: 4 + 3 ln g for g genes"
    )
    initial_scale: Annotated[float, Field(strict=True, gt=0, le=1)] = Field(
        default=0.3, description="standard deviation of the first generation after the start, as a share of the extent"
    )
    members: Annotated[int, Field(strict=True, ge=1, le=10_000)] = Field(
        default=20, description="number of best genomes kept as the result"
    )
    diverse: bool = Field(default=False, strict=True, description="keep diverse members, as in tuning an ensemble")


@dataclass(frozen=True, eq=False)
class CmaEsState(Population):
    """The members, and the distribution that the next generation is drawn from.

    Attributes:
        distribution: state of the library, copied before each change; None before a start.
    """

    distribution: Any = None


class CmaEs(Optimizer):
    """CMA-ES: generations drawn from a normal distribution that learns scale and correlations from ranks.

    It starts from the best of a uniform generation, and restarts in the same way after convergence. Genes are scaled to
    their extents; periodic ones wrap, others clip.
    """

    name = "cma_es"
    source = "Hansen 2016, The CMA Evolution Strategy: A Tutorial; https://github.com/CMA-ES/pycma"
    Options = CmaEsOptions
    options: CmaEsOptions

    def init(self, space: Space) -> CmaEsState:
        """Return a state without members or distribution."""
        return CmaEsState(space, np.empty((0, space.size)), np.empty(0))

    @property
    def least_evaluations(self) -> int:
        """Return the larger of the members and the set population; a default population counts as 4."""
        return max(self.options.population or 4, self.options.members)

    def ask(self, state: Population, rng: Generator) -> Genomes:
        """Return a generation: uniform at a start, else drawn from the distribution."""
        assert isinstance(state, CmaEsState)
        if state.distribution is None:
            return state.space.draw(self._size(state.space), rng)
        distribution = deepcopy(state.distribution)
        distribution.opts["randn"].rng = rng
        scaled = np.array(distribution.ask())
        return state.space.contain(state.space.lower + state.space.extent * scaled)

    def tell(self, state: Population, genomes: Genomes, fitness: FloatArray) -> CmaEsState:
        """Return the state with the newcomers among the members, and the updated distribution."""
        assert isinstance(state, CmaEsState)
        rule = less_fit_of_most_similar if self.options.diverse else least_fit
        kept = insert(state, genomes, fitness, self.options.members, rule)
        learned = self._learned(state, genomes, fitness)
        return CmaEsState(state.space, kept.genomes, kept.fitness, learned)

    def diverse(self, size: int) -> "CmaEs":
        """Return the same optimizer, except that it keeps `size` members that differ from each other."""
        return CmaEs(self.options.model_copy(update={"members": size, "diverse": True}))

    def _learned(self, state: CmaEsState, genomes: Genomes, fitness: FloatArray) -> Any:  # noqa: ANN401 - of the library
        if len(genomes) < self._size(state.space):
            return state.distribution  # the budget ended within the generation
        if state.distribution is None:
            return self._start(state.space, genomes[fitness.argmax()])
        distribution = deepcopy(state.distribution)
        distribution.opts["randn"].rng = np.random.default_rng(0)
        distribution.ask(1)  # the library requires `ask` before `tell`; the draw is not used
        ranks = np.argsort(np.argsort(-fitness, kind="stable"), kind="stable")
        distribution.tell(list(_near(state.space, genomes, distribution.mean)), ranks.tolist(), check_points=False)
        return None if distribution.stop() else distribution

    def _start(self, space: Space, mean: Genome) -> Any:  # noqa: ANN401 - of the library
        options = {
            "popsize": self._size(space),
            "randn": Draws(),
            "seed": np.nan,
            "CMA_mirrors": 0,  # kept between calls
            "tolx": CONVERGED,
            "tolfun": 0,
            "tolfunhist": 0,
            "tolstagnation": np.inf,
            "verbose": -9,
        }
        scaled = (mean - space.lower) / space.extent
        return import_module("cma").CMAEvolutionStrategy(scaled, self.options.initial_scale, options)

    def _size(self, space: Space) -> int:
        return self.options.population or 4 + int(3 * np.log(space.size))


class Draws:
    """The library's source of normal random numbers, which uses the current generator."""

    rng: Generator

    def __call__(self, *shape: int) -> FloatArray:
        """Return standard normal numbers of a shape."""
        return self.rng.standard_normal(shape)


def _near(space: Space, genomes: Genomes, mean: FloatArray) -> FloatArray:
    """Return scaled genomes `(n, g)`; periodic genes are shifted by whole turns to be nearest to the mean."""
    scaled = (genomes - space.lower) / space.extent
    turned = mean + np.mod(scaled - mean + 0.5, 1.0) - 0.5
    return np.where(space.periodic, turned, scaled)
