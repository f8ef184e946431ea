"""The paper's evolutionary algorithm: one newcomer joins, and one member leaves by a rule of replacement."""

from collections.abc import Callable
from typing import Annotated, Literal, TypeAlias

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Genome, Genomes
from gaplab.services.core.optimizers.base import Optimizer, Population

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


REPLACEMENTS: dict[str, tuple[Replacement, Bound]] = {
    "least_fit": (least_fit, bound_of_least_fit),
    "less_fit_of_most_similar": (less_fit_of_most_similar, bound_of_most_similar),
}


class SteadyStateOptions(Frozen):
    """Details of the evolutionary algorithm that the paper leaves to its reference [10], which could not be found.

    The defaults are gaplab's.
    """

    population: Annotated[int, Field(strict=True, ge=2, le=10_000)] = Field(
        default=20, description="number of members; as many as the paper's diverse simulators"
    )
    tournament: Annotated[int, Field(strict=True, ge=1, le=100)] = Field(
        default=3, description="number of members drawn for each parent; the fittest of them is chosen"
    )
    crossover: Annotated[float, Field(strict=True, ge=0, le=1)] = Field(
        default=0.5, description="probability that a newcomer has two parents, with each gene from either of them"
    )
    mutation: Annotated[float, Field(strict=True, gt=0, le=1)] | None = Field(
        default=None, description="probability that a gene mutates; default: 2 divided by the number of genes"
    )
    mutation_scale: Annotated[float, Field(strict=True, gt=0, le=1)] = Field(
        default=0.3, description="largest standard deviation of a mutation, as a share of the gene's extent"
    )
    finest_scale: Annotated[float, Field(strict=True, gt=0, le=1)] = Field(
        default=0.003,
        description="smallest standard deviation of a mutation; each newcomer draws one log-uniformly between the two",
    )
    replacement: Literal["least_fit", "less_fit_of_most_similar"] = Field(
        default="least_fit",
        description="rule for the member that leaves; tuning an ensemble always uses `less_fit_of_most_similar`",
    )
    offspring: Annotated[int, Field(strict=True, ge=1, le=10_000)] = Field(
        default=1, description="newcomers evaluated at once, to use many cores; the paper: 1"
    )


class SteadyState(Optimizer):
    """Steady-state evolution: a newcomer is evaluated and added, then the replacement rule drops a member.

    The first population is drawn uniformly, and evaluated as a whole. Mutation is Gaussian; periodic genes wrap, others
    clip. At least one gene mutates, so a newcomer is a copy only if that gene clips at its bound.
    """

    name = "steady_state"
    source = "Paper, section 2; operators are gaplab's"
    Options = SteadyStateOptions
    options: SteadyStateOptions

    @property
    def least_evaluations(self) -> int:
        """Return the size of the population."""
        return self.options.population

    def ask(self, state: Population, rng: Generator) -> Genomes:
        """Return the missing members of the first population, drawn uniformly; later, newcomers."""
        missing = self.options.population - state.size
        if missing > 0:
            return state.space.draw(missing, rng)
        newcomers = range(self.options.offspring)
        return np.array([self._mutate(state, self._recombine(state, rng), rng) for _ in newcomers])

    def tell(self, state: Population, genomes: Genomes, fitness: FloatArray) -> Population:
        """Return the population with each newcomer added in turn, and a member dropped for each beyond its size."""
        rule, _ = REPLACEMENTS[self.options.replacement]
        return insert(state, genomes, fitness, self.options.population, rule)

    def rejection_thresholds(self, state: Population, genomes: Genomes) -> FloatArray:
        """Return the fitness, `(n,)`, below which each newcomer is dropped at once; -inf if that is uncertain.

        With several newcomers, an earlier one may change the most similar pair, so all thresholds are -inf.
        """
        uncertain = self.options.replacement != "least_fit" and len(genomes) > 1
        if state.size < self.options.population or uncertain:
            return np.full(len(genomes), -np.inf)
        _, bound = REPLACEMENTS[self.options.replacement]
        return np.array([bound(state, genome) for genome in genomes])

    def diverse(self, size: int) -> "SteadyState":
        """Return this evolution with `size` members, in which the less fit of the most similar pair leaves."""
        changed = {"population": size, "replacement": "less_fit_of_most_similar"}
        return SteadyState(self.options.model_copy(update=changed))

    def _recombine(self, state: Population, rng: Generator) -> Genome:
        first = self._parent(state, rng)
        if rng.random() >= self.options.crossover:
            return first
        return np.where(rng.random(len(first)) < 0.5, first, self._parent(state, rng))

    def _parent(self, state: Population, rng: Generator) -> Genome:
        drawn = rng.integers(state.size, size=self.options.tournament)
        parent: Genome = state.genomes[drawn[state.fitness[drawn].argmax()]]
        return parent

    def _mutate(self, state: Population, genome: Genome, rng: Generator) -> Genome:
        size = len(genome)
        mutates = rng.random(size) < (self.options.mutation or min(1.0, 2.0 / size))
        mutates[rng.integers(size)] = True
        finest, greatest = self.options.finest_scale, self.options.mutation_scale
        scale = finest * (greatest / finest) ** rng.random()
        return state.space.contain(genome + mutates * (scale * state.space.extent * rng.standard_normal(size)))
