"""The one driver that spends a budget of evaluations on an optimizer."""

from collections.abc import Callable
from copy import deepcopy
from functools import partial
from typing import NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.random import Generator

from gaplab.services.core.answers import Following
from gaplab.services.core.arrays import FloatArray, Genomes
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.optimizers.base import Optimizer, Population
from gaplab.services.core.space import Space

FARTHEST = 32
"""Most genomes to evaluate at once. About one newcomer in ten stays, so later ones are hardly ever used."""


class Question(NamedTuple):
    """A question of an optimizer: the fitness of these genomes.

    Attributes:
        genomes: `(n, g)` to evaluate.
        thresholds: `(n,)`: the optimizer rejects a genome whose fitness is below its threshold, so any number below it
            is a valid answer; -inf if it may keep the genome at any fitness.
        following: returns the genomes of the next question if the optimizer rejects all of these.
    """

    genomes: Genomes
    thresholds: FloatArray
    following: Following


Evaluate: TypeAlias = Callable[[Question], FloatArray]
"""A function that returns the fitness of each genome, `(n,)`, to be maximised; not finite if the physics failed."""


@runtime_checkable
class Rejecting(Protocol):
    """An optimizer that knows beforehand which newcomers it will reject."""

    def rejection_thresholds(self, state: Population, genomes: Genomes) -> FloatArray:
        """Return the fitness, `(n,)`, below which each genome would leave the state as it is; -inf if unknown."""
        ...


def maximise(
    optimizer: Optimizer,
    space: Space,
    evaluate: Evaluate,
    evaluations: int,
    rng: Generator,
    start: Genomes | None = None,
) -> Population:
    """Return the ranked population after exactly `evaluations` fitness evaluations; nan and infinities never win.

    A copy of a genome that the search has evaluated counts, but is not evaluated again unless it was rejected. Copies
    are common: genes clip at their bounds.

    Args:
        optimizer: asks for genomes and is told their fitness.
        space: space of the genomes.
        evaluate: returns fitnesses; each call has the optimizer's genomes, or as many as the budget has left.
        evaluations: the budget, at least 1.
        rng: all randomness of the search.
        start: `(n, g)`, n ≥ 1: genomes that are evaluated before those that the optimizer asks for; default: none.
    """
    thresholds_of = optimizer.rejection_thresholds if isinstance(optimizer, Rejecting) else _unknown
    state = optimizer.init(space)
    known: dict[bytes, float] = {}
    while evaluations > 0:
        genomes = (_asked(optimizer, state, space, rng) if start is None else start)[:evaluations]
        start = None
        if not len(genomes):
            raise PluginBroken(f"optimizer {optimizer.name!r} asks for no genome although {evaluations} are left")
        keys = [genome.tobytes() for genome in genomes]
        new = [index for index, key in enumerate(keys) if key not in known]
        fitness = np.array([known.get(key, np.nan) for key in keys])
        if new:
            thresholds = thresholds_of(state, genomes)[new]
            following = partial(_following, optimizer, state, thresholds, rng, evaluations - len(genomes))
            fitness[new] = evaluate(Question(genomes[new], thresholds, following))
            exact = (index for index, least in zip(new, thresholds, strict=True) if not fitness[index] < least)
            known.update((keys[index], float(fitness[index])) for index in exact)
        state = optimizer.tell(state, genomes, np.where(np.isfinite(fitness), fitness, -np.inf))
        evaluations -= len(genomes)
    return state.ranked()


def _asked(optimizer: Optimizer, state: Population, space: Space, rng: Generator) -> Genomes:
    """Return the genomes that an optimizer asks for, `(n, g)`.

    Raises:
        PluginBroken: they are no such array.
    """
    asked = optimizer.ask(state, rng)
    try:
        genomes = np.asarray(asked, dtype=np.float64)
    except (TypeError, ValueError):
        genomes = np.empty(0)
    if genomes.ndim != 2 or genomes.shape[1] != space.size:
        msg = f"genomes of shape {np.shape(genomes)}; permitted: (n, {space.size})"
        raise PluginBroken(f"optimizer {optimizer.name!r} asks for {msg}")
    return genomes


def _unknown(_: Population, genomes: Genomes) -> FloatArray:
    return np.full(len(genomes), -np.inf)


def _following(
    optimizer: Optimizer, state: Population, thresholds: FloatArray, rng: Generator, left: int, count: int
) -> Genomes:
    """Return up to `count` genomes that the optimizer asks for next if its state stays as it is; none if it cannot."""
    wanted = min(count, FARTHEST - 1, left) if thresholds.max() > -np.inf else 0
    rng, genomes = deepcopy(rng), np.empty((0, state.space.size))
    while len(genomes) < wanted:
        genomes = np.vstack([genomes, _asked(optimizer, state, state.space, rng)])
    return genomes[:wanted]
