"""The contract of an optimizer: pure functions on a population, which is a value."""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from gaplab.services.core.arrays import FloatArray, Genomes
from gaplab.services.core.registry import Plugin
from gaplab.services.core.types import Space


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
