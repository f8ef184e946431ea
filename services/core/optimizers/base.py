"""What an optimizer is: a value and pure functions. And the one driver that spends an evaluation budget on it."""

from abc import abstractmethod
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np
from numpy.random import Generator

from gaplab.services.core.arrays import FloatArray, Genomes
from gaplab.services.core.registry import Plugin
from gaplab.services.core.types import Space

Evaluate: TypeAlias = Callable[[Genomes, FloatArray], FloatArray]
"""`(n, g)` genomes, `(n,)` bounds -> `(n,)`: the fitness of each, maximised; not finite where it has none.

A fitness below its bound need not be exact: any number below the bound will do.
"""


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

    def hopeless(self, state: Population, genomes: Genomes) -> FloatArray:  # noqa: ARG002 - for those who know better
        """`(n,)`: the fitness below which each of the genomes would change nothing, if it were told; -inf if none."""
        return np.full(len(genomes), -np.inf)

    @abstractmethod
    def diverse(self, size: int) -> "Optimizer":
        """The same optimizer, but it keeps `size` members that differ from each other."""


class Ahead(Protocol):
    """Evaluates what will probably be asked for next together with what is asked for now."""

    def room(self) -> int:
        """How many genomes can be evaluated at a time now, for little more than the price of one."""
        ...

    def expect(self, genomes: Genomes) -> None:
        """These `(n, g)` will be asked for one after the other, if what is asked for now changes nothing."""
        ...


def maximise(
    optimizer: Optimizer,
    space: Space,
    evaluate: Evaluate,
    evaluations: int,
    rng: Generator,
    ahead: Ahead | None = None,
) -> Population:
    """The population after exactly `evaluations` fitness evaluations, ranked; what is not finite never wins.

    A genome that the search has evaluated before counts, but is not evaluated again, unless it was hopeless then.

    Args:
        optimizer: that searches.
        space: that it searches in.
        evaluate: the fitness, called with as many genomes as the optimizer asks for, or as the budget has left.
        evaluations: the budget, at least 1.
        rng: all randomness of the search.
        ahead: is told what follows if a newcomer is hopeless; changes no number.
    """
    state = optimizer.init(space)
    remembered = Remembered(evaluate)
    while evaluations > 0:
        genomes = optimizer.ask(state, rng)[:evaluations]
        bounds = optimizer.hopeless(state, genomes)
        if ahead is not None and bounds.max() > -np.inf:
            ahead.expect(_following(optimizer, state, deepcopy(rng), min(ahead.room(), evaluations) - len(genomes)))
        fitness = remembered(genomes, bounds)
        state = optimizer.tell(state, genomes, np.where(np.isfinite(fitness), fitness, -np.inf))
        evaluations -= len(genomes)
    return state.ranked()


def _following(optimizer: Optimizer, state: Population, rng: Generator, count: int) -> Genomes:
    """`(n, g)`, n ≥ count: what the optimizer asks for next, and after that, while its state is what it is."""
    following = np.empty((0, state.space.size))
    while len(following) < count:
        following = np.vstack([following, optimizer.ask(state, rng)])
    return following


class Remembered:
    """An Evaluate that knows what it evaluated: gene by gene the same genome has the same fitness.

    Genes clip at their bounds, so a small mutation of a gene at its bound gives a copy more often than one would think.
    """

    def __init__(self, evaluate: Evaluate) -> None:
        self._evaluate = evaluate
        self._known: dict[bytes, float] = {}

    def __call__(self, genomes: Genomes, bounds: FloatArray) -> FloatArray:
        """As the Evaluate; only fitnesses that are exact are remembered."""
        keys = [genome.tobytes() for genome in genomes]
        fresh = [index for index, key in enumerate(keys) if key not in self._known]
        fitness = np.array([self._known.get(key, np.nan) for key in keys])
        if fresh:
            fitness[fresh] = self._evaluate(genomes[fresh], bounds[fresh])
            exact = (index for index in fresh if not fitness[index] < bounds[index])
            self._known.update((keys[index], float(fitness[index])) for index in exact)
        return fitness
