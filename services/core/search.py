"""The one driver that spends a budget of evaluations on an optimizer, and the search that a strategy gets."""

from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass, field
from functools import partial
from math import isfinite, nan
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.random import Generator

from gaplab.services.core.answers import Answers, Following, nothing
from gaplab.services.core.arrays import NO_GENOMES, NO_READINGS, FloatArray, Genome, Genomes, Parameters, nearest
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.optimizers.base import Optimizer, Population
from gaplab.services.core.space import Space
from gaplab.services.core.strategies.base import Score, Strategy
from gaplab.services.core.types import Belief

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


def maximise(
    optimizer: Optimizer,
    space: Space,
    evaluate: Evaluate,
    evaluations: int,
    rng: Generator,
    start: Genomes | None = None,
) -> Population:
    """Return the ranked population after exactly `evaluations` fitness evaluations; nan and infinities never win.

    An optimizer with several objectives may be told `(n, o)` fitnesses.

    A copy of a genome that the search has evaluated counts, but is not evaluated again unless it was rejected. Copies
    are common: genes clip at their bounds.

    Args:
        optimizer: asks for genomes and is told their fitness.
        space: space of the genomes.
        evaluate: returns fitnesses; each call has the optimizer's genomes, or as many as the budget has left.
        evaluations: the budget, at least 1.
        rng: all randomness of the search.
        start: `(n, g)`: genomes that are evaluated before those that the optimizer asks for; default: none.
    """
    state = optimizer.init(space)
    known: dict[bytes, FloatArray] = {}
    while evaluations > 0:
        genomes = (_asked(optimizer, state, space, rng) if start is None or not len(start) else start)[:evaluations]
        start = None
        if not len(genomes):
            raise PluginBroken(f"optimizer {optimizer.name!r} asks for no genome; evaluations left: {evaluations}")
        keys = [genome.tobytes() for genome in genomes]
        new = [index for index, key in enumerate(keys) if key not in known]
        answers: Iterator[FloatArray] = iter(())
        if new:
            thresholds = optimizer.rejection_thresholds(state, genomes)[new]
            following = partial(_following, optimizer, state, thresholds, rng, evaluations - len(genomes))
            answers = iter(evaluate(Question(genomes[new], thresholds, following)))
        fitness = np.array([known[key] if key in known else next(answers) for key in keys])
        if new:
            exact = (index for index, least in zip(new, thresholds, strict=True) if not np.all(fitness[index] < least))
            known.update((keys[index], fitness[index]) for index in exact)
        state = optimizer.tell(state, genomes, _finite(fitness))
        evaluations -= len(genomes)
    return state.ranked()


def _finite(scores: FloatArray) -> FloatArray:
    """Return scores `(n,)` or `(n, o)`: -inf for a genome with one that is not finite."""
    finite = np.isfinite(scores) if scores.ndim == 1 else np.isfinite(scores).all(axis=1, keepdims=True)
    return np.where(finite, scores, -np.inf)


def _asked(optimizer: Optimizer, state: Population, space: Space, rng: Generator) -> Genomes:
    """Return the genomes that an optimizer asks for, `(n, g)`.

    Raises:
        PluginBroken: they are not such an array.
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


def _following(
    optimizer: Optimizer, state: Population, thresholds: FloatArray, rng: Generator, left: int, count: int
) -> Genomes:
    """Return up to `count` genomes that the optimizer asks for next if its state stays as it is; none if it cannot."""
    wanted = min(count, FARTHEST - 1, left) if thresholds.max() > -np.inf else 0
    rng, genomes = deepcopy(rng), np.empty((0, state.space.size))
    while len(genomes) < wanted:
        genomes = np.vstack([genomes, _asked(optimizer, state, state.space, rng)])
    return genomes[:wanted]


@dataclass(frozen=True)
class Allowance:
    """The rollouts of a search.

    Attributes:
        evaluations: of controllers; 0 permits no search.
        simulators: most simulators in which a controller is evaluated.
    """

    evaluations: int
    simulators: int

    @classmethod
    def of_selection(cls, strategy: Strategy, evaluations: int, tunables: int, *, learned: bool) -> "Allowance":
        """Return the allowance of a selection from its budget of evaluations.

        Args:
            strategy: selects.
            evaluations: its budget.
            tunables: number of tunables.
            learned: whether there is a sample whose measurement succeeded.
        """
        simulators = strategy.selection_simulators(tunables, learned=learned)
        return cls._shared(strategy, evaluations if strategy.searches else 0, simulators)

    @classmethod
    def of_transfer(cls, strategy: Strategy, evaluations: int, tunables: int) -> "Allowance":
        """Return the allowance of a transfer from its budget of evaluations."""
        return cls._shared(strategy, evaluations, strategy.transfer_simulators(tunables))

    @classmethod
    def _shared(cls, strategy: Strategy, evaluations: int, simulators: int) -> "Allowance":
        return cls(evaluations // simulators if strategy.equal_rollouts else evaluations, simulators)

    @property
    def rollouts(self) -> int:
        """Return the number of rollouts."""
        return self.evaluations * self.simulators


@dataclass
class ControllerSearch:
    """A Search that can be called once, and remembers what it found.

    Attributes:
        strategy: its name, for errors.
        optimizer: searches, unless the strategy gives candidates.
        belief: what the strategy knows.
        answers: answers of the simulators.
        allowance: the rollouts to spend.
        rng: random generator of the optimizer.
        members: `(n, g)`: the final population of its optimizer, best first.
    """

    strategy: str
    optimizer: Optimizer
    belief: Belief
    answers: Answers
    allowance: Allowance
    rng: Generator
    members: Genomes = field(default_factory=lambda: NO_GENOMES, init=False)
    _spent: bool = field(default=False, init=False)
    _found: Population | None = field(default=None, init=False)

    def __call__(
        self,
        score: Score,
        *,
        parameters: Parameters | None = None,
        senses: bool = False,
        candidates: Genomes | None = None,
        start: Genomes | None = None,
    ) -> Genome:
        """Return the genome `(g,)` with the highest score found; of several scores, the first counts."""
        self._spend()
        simulators = self._checked(parameters)

        def scored(asked: Question) -> FloatArray:
            answer = self._sensed if senses else self.answers
            return self._scores(score(asked.genomes, answer(asked.genomes, simulators, asked.following)), asked)

        space, evaluations = self.belief.space, self.allowance.evaluations
        if candidates is None and self.belief.candidates is not None:
            candidates = self.belief.draw(evaluations, self.rng)
        if candidates is None:
            found = maximise(self.optimizer, space, scored, evaluations, self.rng, start)
            self.members = found.genomes
        else:
            asked = Question(candidates[:evaluations], NO_READINGS, nothing)
            found = Population(space, asked.genomes, _finite(scored(asked))).ranked()
        self._found = found
        best: Genome = found.genomes[0]
        return best

    def score_of(self, genome: Genome) -> float:
        """Return the first score of a genome `(g,)` if the search kept it, and the score is finite; else nan."""
        if self._found is None:
            return nan
        scores = self._found.first[(self._found.genomes == genome).all(axis=1)]
        return float(scores[0]) if len(scores) and isfinite(scores[0]) else nan

    def _spend(self) -> None:
        if self._spent or not self.allowance.evaluations:
            permitted = "one search a selection or transfer is permitted" if self._spent else "it has searches = False"
            raise PluginBroken(f"strategy {self.strategy!r} has no budget left for this search: {permitted}")
        self._spent = True

    def _checked(self, parameters: Parameters | None) -> Parameters:
        """Return the simulators to search in, `(m, p)`."""
        source = f"strategy {self.strategy!r}"
        if parameters is None:
            rows = self.belief.parameters
        else:
            rows = np.array([self.belief.tunables.check(row, source) for row in np.atleast_2d(parameters)])
        if not 1 <= len(rows) <= self.allowance.simulators:
            permitted = f"permitted: 1 to {self.allowance.simulators}, as it states"
            raise PluginBroken(f"{source} searches in {len(rows)} simulators; {permitted}")
        return rows

    def _scores(self, given: object, asked: Question) -> FloatArray:
        """Return the scores of a question, `(n,)`, or `(n, o)` for an optimizer with several objectives.

        Raises:
            PluginBroken: they are not such an array.
        """
        scores, count, several = np.asarray(given, dtype=np.float64), len(asked.genomes), self.optimizer.objectives
        if scores.shape[:1] != (count,) or scores.ndim > 1 + several:
            msg = f"scores {count} genomes with an array of shape {scores.shape}; permitted: (n,)"
            more = ", or (n, o)" if several else f", as the optimizer {self.optimizer.name!r} has one objective"
            raise PluginBroken(f"strategy {self.strategy!r} {msg}{more}")
        return scores

    def _sensed(self, genomes: Genomes, simulators: Parameters, following: Following) -> FloatArray:
        if self.answers.senses:
            outcomes = self.answers.sense(genomes, simulators)
            return nearest(outcomes, outcomes[:, :1], self.answers.periods)
        return self.answers(genomes, simulators, following)[..., None]
