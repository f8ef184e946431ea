"""Evolve a controller in simulation, go on in reality, and evolve the simulator to agree with reality; in rounds."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import Genome, Genomes
from gaplab.services.core.space import Space
from gaplab.services.core.strategies.base import Search, Strategy
from gaplab.services.core.types import Belief, Sample

Scale = Annotated[float, Field(strict=True, gt=0, le=1)]


class BackToRealityOptions(Frozen):
    """Options of the strategy `back_to_reality`; the authors' numbers could not be found."""

    trials: Annotated[int, Field(strict=True, ge=0, le=1_000)] = Field(
        default=4, description="controllers of a round that learning in reality tries after its sample; gaplab's: 4"
    )
    learn_from_trials: bool = Field(
        default=False,
        description="simulators are tuned on these too, after each, not on the samples alone; the authors': no, as "
        "surveyed",
    )
    step: Scale = Field(
        default=0.05,
        description="first standard deviation of a trial's change, as a share of each gene's extent; gaplab's default",
    )
    after_success: Annotated[float, Field(strict=True, ge=1, le=10)] = Field(
        default=1.22, description="factor of the step after a trial that is fitter; gaplab's default"
    )
    after_failure: Annotated[float, Field(strict=True, gt=0, le=1)] = Field(
        default=0.95, description="factor of the step after a trial that is not; gaplab's default"
    )
    mutants: Annotated[int, Field(strict=True, ge=0, le=10_000)] = Field(
        default=19, description="mutants of the seed that begin a search, beside the seed itself; gaplab's default"
    )
    mutation: Scale = Field(
        default=0.1, description="their standard deviation, as a share of each gene's extent; gaplab's default"
    )


class BackToReality(Strategy):
    """The fittest in the tuned simulator, then trials of evolution in reality itself that begin with it.

    The best controller measured so far is the seed. It is transferred, and the next search in simulation begins with
    it. All trials count as real-world evaluations. The authors' discrepancy is `absolute_fitness`. Do not use it where
    real-world evaluations are few: a small step climbs the roughness of fitness, and its trials teach the simulator
    nothing. Nor with samples from before: rounds are counted from the first sample.
    """

    name = "back_to_reality"
    source = "Zagal, Ruiz-del-Solar and Vallejos 2004; Zagal and Ruiz-del-Solar 2007; the numbers are gaplab's"
    Options = BackToRealityOptions
    options: BackToRealityOptions

    def transfer_simulators(self, tunables: int) -> int:  # noqa: ARG002 - the port's signature
        """Return none."""
        return 0

    def lessons(self, samples: Sequence[Sample]) -> Sequence[Sample]:
        """Return the first sample of each round, or all."""
        return samples if self.options.learn_from_trials else samples[:: self.options.trials + 1]

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:
        """Return the fittest controller found in the best simulator, or the next trial of a round."""
        begun = len(belief.samples) % (self.options.trials + 1)
        if begun:
            parent, step = self._learned(belief.samples[-begun:])
            trial: Genome = _mutated(parent[None, :], step, belief.space, rng)[0]
            return trial
        seed = _fittest(belief)
        start = None if seed is None else self._first(seed, belief.space, rng)
        return search(lambda _, fitnesses: fitnesses[:, 0], parameters=belief.parameters[:1], start=start)

    def transfer(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the seed; before any sample, the known controller."""
        seed = _fittest(belief)
        return belief.known if seed is None else seed

    def _first(self, seed: Genome, space: Space, rng: Generator) -> Genomes:
        """Return the seed and its mutants, `(n, g)`."""
        copies = np.repeat(seed[None, :], self.options.mutants, axis=0)
        return np.vstack([seed, _mutated(copies, self.options.mutation, space, rng)])

    def _learned(self, measured: Sequence[Sample]) -> tuple[Genome, float]:
        """Return the parent of the next trial and its step, after a round's sample and the trials since."""
        (best, *trials), step = measured, self.options.step
        for trial in trials:
            before, now = np.nan_to_num([best.fitness, trial.fitness], nan=-np.inf)
            better = bool(now > before)
            best = trial if better else best
            step *= self.options.after_success if better else self.options.after_failure
        return best.genome, step


def _fittest(belief: Belief) -> Genome | None:
    """Return the fittest sample's genome; of equals, the first; None without any."""
    return max(belief.learnable, key=lambda each: each.fitness).genome if belief.learnable else None


def _mutated(genomes: Genomes, step: float, space: Space, rng: Generator) -> Genomes:
    return space.contain(genomes + step * space.extent * rng.standard_normal(genomes.shape))
