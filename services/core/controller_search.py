"""The search over controllers that a selection or a transfer has a budget for."""

from dataclasses import dataclass, field
from math import nan

import numpy as np
from numpy.random import Generator

from gaplab.services.core.answers import Answers, Following, nothing
from gaplab.services.core.arrays import FloatArray, Genome, Genomes, Parameters
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.optimizers.base import Optimizer, Population
from gaplab.services.core.search import maximise
from gaplab.services.core.sensors import nearest
from gaplab.services.core.strategies.base import Score, Strategy
from gaplab.services.core.types import Belief


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
    def of_selection(cls, strategy: Strategy, evaluations: int, tunables: int, *, learned: bool = False) -> "Allowance":
        """Return the allowance of a selection from its budget of evaluations.

        Args:
            strategy: selects.
            evaluations: its budget.
            tunables: number of tunables.
            learned: whether there is a sample whose measurement succeeded.
        """
        needed = strategy.later_selection_simulators if learned else strategy.selection_simulators
        simulators = needed(tunables)
        return cls(strategy.search_evaluations(evaluations, simulators) if strategy.searches else 0, simulators)

    @classmethod
    def of_transfer(cls, strategy: Strategy, evaluations: int, tunables: int) -> "Allowance":
        """Return the allowance of a transfer from its budget of evaluations."""
        simulators = strategy.transfer_simulators(tunables)
        return cls(strategy.search_evaluations(evaluations, simulators), simulators)

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
    """

    strategy: str
    optimizer: Optimizer
    belief: Belief
    answers: Answers
    allowance: Allowance
    rng: Generator
    _spent: bool = field(default=False, init=False)
    _found: Genome | None = field(default=None, init=False)
    _score: float = field(default=nan, init=False)

    def __call__(
        self,
        score: Score,
        *,
        parameters: Parameters | None = None,
        senses: bool = False,
        candidates: Genomes | None = None,
    ) -> Genome:
        """Return the genome `(g,)` with the highest score found."""
        self._spend()
        simulators = self._checked(parameters)

        def scored(genomes: Genomes, following: Following = nothing) -> FloatArray:
            if senses:
                return score(genomes, self._sensed(genomes, simulators, following))
            return score(genomes, self.answers(genomes, simulators, following))

        space, evaluations = self.belief.space, self.allowance.evaluations
        if candidates is None:
            found = maximise(
                self.optimizer, space, lambda asked: scored(asked.genomes, asked.following), evaluations, self.rng
            )
        else:
            scores = scored(candidates[:evaluations])
            scores = np.where(np.isfinite(scores), scores, -np.inf)
            found = Population(space, candidates[:evaluations], scores).ranked()
        best: Genome = found.genomes[0]
        self._found, self._score = best, float(found.fitness[0])
        return best

    def score_of(self, genome: Genome) -> float:
        """Return the score of a genome `(g,)` if the search found it, and the score is finite; else nan."""
        found = self._found is not None and np.array_equal(genome, self._found)
        return self._score if found and np.isfinite(self._score) else nan

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

    def _sensed(self, genomes: Genomes, simulators: Parameters, following: Following) -> FloatArray:
        if self.answers.senses:
            outcomes = self.answers.sense(genomes, simulators)
            return nearest(outcomes, outcomes[:, :1], self.answers.periods)
        return self.answers(genomes, simulators, following)[..., None]
