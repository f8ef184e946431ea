"""The contract of an optimizer: ask and tell, as pure functions of a population."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.random import Generator

from gaplab.services.core.arrays import FloatArray, Genomes
from gaplab.services.core.registry import Plugin
from gaplab.services.core.space import Space


@dataclass(frozen=True, eq=False)
class Population:
    """Genomes with their fitness: the whole state of an optimizer.

    Attributes:
        space: the space of the genomes.
        genomes: `(n, g)`, the members from the oldest to the newest.
        fitness: `(n,)`, or `(n, o)` of several objectives; -inf for a member that has none.
    """

    space: Space
    genomes: Genomes
    fitness: FloatArray

    @property
    def size(self) -> int:
        """The number of members."""
        return len(self.fitness)

    @property
    def first(self) -> FloatArray:
        """The fitness `(n,)`; of several objectives, the first."""
        return self.fitness if self.fitness.ndim == 1 else self.fitness[:, 0]

    def ranked(self) -> "Population":
        """Return the members from the fittest to the least fit, by the first objective; of equals, the older first."""
        order = np.argsort(-self.first, kind="stable")
        return Population(self.space, self.genomes[order], self.fitness[order])


class Optimizer(Plugin):
    """Maximises a fitness: it asks for genomes and is told their fitness.

    It compares fitnesses by rank, so any monotone transform of the fitness gives the same search.

    Attributes:
        objectives: true if the fitness that it is told may be `(n, o)`, of which it maximises each. With one objective,
            it still is an optimizer.
    """

    objectives: ClassVar[bool] = False

    def init(self, space: Space) -> Population:
        """Return an empty population in the space."""
        return Population(space, np.empty((0, space.size)), np.empty(0))

    @property
    @abstractmethod
    def least_evaluations(self) -> int:
        """Return the smallest sensible budget: evaluations of one full population."""

    @abstractmethod
    def ask(self, state: Population, rng: Generator) -> Genomes:
        """Return the genomes to evaluate next, `(n, g)` with n ≥ 1."""

    @abstractmethod
    def tell(self, state: Population, genomes: Genomes, fitness: FloatArray) -> Population:
        """Return the population after learning the fitness `(n,)` of genomes `(n, g)`."""

    def rejection_thresholds(self, state: Population, genomes: Genomes) -> FloatArray:  # noqa: ARG002 - it is unknown
        """Return the fitness, `(n,)`, below which each genome would leave the state as it is; -inf if unknown."""
        return np.full(len(genomes), -np.inf)

    @abstractmethod
    def diverse(self, size: int) -> "Optimizer":
        """Return the same optimizer, except that it keeps `size` members that differ from each other."""
