"""NSGA-II: several objectives at once, by fronts of members that none dominates, and by their distance in a front.

It is NumPy: pymoo, whose fronts and distances the tests compare with these, would bring compiled libraries for sixty
lines, and its variation knows no genes that wrap. Fronts take n² comparisons, less than a millisecond for 40 members.
"""

from typing import Annotated, ClassVar

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Genomes
from gaplab.services.core.optimizers.base import Optimizer, Population
from gaplab.services.core.optimizers.steady_state import insert, less_fit_of_most_similar
from gaplab.services.core.registry import Presets

Share = Annotated[float, Field(strict=True, ge=0, le=1)]
Index = Annotated[float, Field(strict=True, ge=0, le=1_000)]


class Nsga2Options(Frozen):
    """Constants; those of the authors of *transferability* are as in their library, sferes2."""

    population: Annotated[int, Field(strict=True, ge=2, le=10_000)] = Field(
        default=20, description="number of members and of newcomers; gaplab's default; published: 100"
    )
    crossover: Share = Field(default=0.5, description="probability that two newcomers are crossed; sferes2: 0.5")
    crossover_index: Index = Field(
        default=10.0, description="η of simulated binary crossover; larger: closer to the parents; sferes2: 10"
    )
    mutation: Share = Field(
        default=0.1, description="probability that a gene mutates, besides one in a newcomer without any; sferes2: 0.1"
    )
    mutation_index: Index = Field(default=15.0, description="η of polynomial mutation; larger: smaller; sferes2: 15")
    diverse: bool = Field(default=False, strict=True, description="keep diverse members, as in tuning an ensemble")


class Nsga2(Optimizer):
    """NSGA-II: members that no other dominates survive, of equal ones those that are far from others in objectives.

    With one objective it is an evolution by rank that keeps the better half of parents and newcomers. Periodic genes
    wrap, others clip. Do not use it for one objective: `cma_es` and `steady_state` need fewer evaluations.
    """

    name = "nsga2"
    source = "Deb, Pratap, Agarwal and Meyarivan 2002; constants: sferes2, by the authors of transferability"
    presets: ClassVar[Presets] = {"as_published": {"population": 100}}
    objectives = True
    Options = Nsga2Options
    options: Nsga2Options

    @property
    def least_evaluations(self) -> int:
        """Return the size of the population."""
        return self.options.population

    def ask(self, state: Population, rng: Generator) -> Genomes:
        """Return the missing members of the first population, drawn uniformly; later, as many newcomers as members."""
        missing = self.options.population - state.size
        if missing > 0:
            return state.space.draw(missing, rng)
        newcomers = self._mutated(state, self._crossed(state, rng), rng)
        return newcomers[: state.size]

    def tell(self, state: Population, genomes: Genomes, fitness: FloatArray) -> Population:
        """Return the best of members and newcomers, by front, then by crowding; of equals, the older."""
        size = self.options.population
        if self.options.diverse:
            return insert(state, genomes, fitness, size, less_fit_of_most_similar)
        if state.size:
            genomes, fitness = np.vstack([state.genomes, genomes]), np.concatenate([state.fitness, fitness])
        ranks = fronts(fitness)
        kept = np.sort(np.lexsort((-crowding(fitness, ranks), ranks))[:size])
        return Population(state.space, genomes[kept], fitness[kept])

    def diverse(self, size: int) -> "Nsga2":
        """Return this evolution with `size` members, in which the less fit of the most similar pair leaves."""
        return Nsga2(self.options.model_copy(update={"population": size, "diverse": True}))

    def _crossed(self, state: Population, rng: Generator) -> Genomes:
        """Return newcomers by simulated binary crossover of the winners of binary tournaments."""
        pairs = (state.size + 1) // 2
        entrants = np.concatenate([rng.permutation(state.size) for _ in range(3)])[: 4 * pairs]
        ranks = fronts(state.fitness)
        apart = crowding(state.fitness, ranks)
        first, second = entrants.reshape(-1, 2).T
        wins = (ranks[second] < ranks[first]) | ((ranks[second] == ranks[first]) & (apart[second] > apart[first]))
        mothers, fathers = state.genomes[np.where(wins, second, first)].reshape(2, pairs, -1)
        drawn, power = rng.random(mothers.shape), 1.0 / (self.options.crossover_index + 1.0)
        crosses = (rng.random((pairs, 1)) < self.options.crossover) & (rng.random(mothers.shape) < 0.5)
        spread = np.where(drawn <= 0.5, 2.0 * drawn, 0.5 / (1.0 - drawn)) ** power
        outwards = np.where(crosses, spread - 1.0, 0.0) * state.space.apart(fathers, mothers) * state.space.extent / 2.0
        return np.vstack([mothers - outwards, fathers + outwards])

    def _mutated(self, state: Population, genomes: Genomes, rng: Generator) -> Genomes:
        """Return the genomes after polynomial mutation of at least one gene of each."""
        mutates = rng.random(genomes.shape) < self.options.mutation
        mutates[np.arange(len(genomes)), rng.integers(state.space.size, size=len(genomes))] |= ~mutates.any(axis=1)
        drawn, power = rng.random(genomes.shape), 1.0 / (self.options.mutation_index + 1.0)
        steps = np.where(drawn < 0.5, (2.0 * drawn) ** power - 1.0, 1.0 - (2.0 * (1.0 - drawn)) ** power)
        return state.space.contain(genomes + np.where(mutates, steps, 0.0) * state.space.extent)


def fronts(fitness: FloatArray) -> NDArray[np.int64]:
    """Return the front of each member with fitness `(n,)` or `(n, o)`: 0 if no other dominates it, `(n,)`.

    One dominates another if it is at least as fit in every objective, and fitter in one. Front k is what none dominates
    without the fronts before.
    """
    values = fitness.reshape(len(fitness), -1)
    least = np.asarray((values[:, None] >= values).all(axis=2))
    dominates = least & ~least.T
    ranks, left, front = np.zeros(len(values), dtype=np.int64), np.ones(len(values), dtype=bool), 0
    while left.any():
        now = left & ~dominates[left].any(axis=0)
        ranks[now] = front
        left, front = left & ~now, front + 1
    return ranks


def crowding(fitness: FloatArray, ranks: NDArray[np.int64]) -> FloatArray:
    """Return the crowding distance of each member within its front, `(n,)`: inf at the ends of an objective."""
    values, found = fitness.reshape(len(fitness), -1), np.zeros(len(fitness))
    for column in np.where(np.isfinite(values), values, 0.0).T:  # all of a front fail, or none
        order = np.lexsort((column, ranks))
        sorted_ = column[order]
        begins = np.diff(ranks[order], prepend=-1) > 0
        starts = np.flatnonzero(begins)
        sizes = np.diff(starts, append=len(order))
        extent = np.repeat(sorted_[starts + sizes - 1] - sorted_[starts], sizes)
        ends = (begins | np.append(begins[1:], True)) & (extent > 0)
        between = np.append(sorted_[1:], 0.0) - np.append(0.0, sorted_[:-1])
        found[order] += np.where(ends, np.inf, np.where(extent > 0, between, 0.0) / np.where(extent > 0, extent, 1.0))
    return found
