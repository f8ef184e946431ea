"""What an optimizer is: a value and pure functions. And the one driver that spends an evaluation budget on it."""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.random import Generator

from services.core.arrays import FloatArray, Genomes
from services.core.registry import Plugin
from services.core.types import Space

Evaluate: TypeAlias = Callable[[Genomes], FloatArray]
"""`(n, g)` -> `(n,)`: the fitness of each, maximised; nan where it has none."""


@dataclass(frozen=True, eq=False)
class Population:
    """Genomes with their fitness: all that an optimizer remembers.

    Attributes:
        space: that the genomes live in.
        genomes: `(n, g)`.
        fitness: `(n,)`; -inf for what has none.
    """

    space: Space
    genomes: Genomes
    fitness: FloatArray

    @property
    def size(self) -> int:
        """How many members there are."""
        return len(self.fitness)

    def ranked(self) -> "Population":
        """The members from the fittest to the least fit; of equals, the older first."""
        order = np.argsort(-self.fitness, kind="stable")
        return Population(self.space, self.genomes[order], self.fitness[order])


class Optimizer(Plugin):
    """Maximises a fitness by asking for genomes and being told their fitness.

    It compares fitnesses by rank alone, so any monotone transform of them gives the same search.
    """

    def init(self, space: Space) -> Population:
        """An empty population in the space."""
        return Population(space, np.empty((0, space.size)), np.empty(0))

    @property
    @abstractmethod
    def least_evaluations(self) -> int:
        """The smallest budget that makes sense: one full population."""

    @abstractmethod
    def ask(self, state: Population, rng: Generator) -> Genomes:
        """`(n, g)` genomes to evaluate next, n ≥ 1."""

    @abstractmethod
    def tell(self, state: Population, genomes: Genomes, fitness: FloatArray) -> Population:
        """The population after learning the fitness `(n,)` of genomes `(n, g)`."""

    @abstractmethod
    def diverse(self, size: int) -> "Optimizer":
        """The same optimizer, but it keeps `size` members that differ from each other."""


def maximise(optimizer: Optimizer, space: Space, evaluate: Evaluate, evaluations: int, rng: Generator) -> Population:
    """The population after exactly `evaluations` fitness evaluations, ranked; nan never wins.

    Args:
        optimizer: that searches.
        space: that it searches in.
        evaluate: the fitness, called with as many genomes as the optimizer asks for, or as the budget has left.
        evaluations: the budget, at least 1.
        rng: all randomness of the search.
    """
    state = optimizer.init(space)
    while evaluations > 0:
        genomes = optimizer.ask(state, rng)[:evaluations]
        fitness = evaluate(genomes)
        state = optimizer.tell(state, genomes, np.where(np.isnan(fitness), -np.inf, fitness))
        evaluations -= len(genomes)
    return state.ranked()
