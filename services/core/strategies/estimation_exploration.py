"""Try a fit controller, or one on whose readings the best models disagree, and tune competing models in between."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Genome, Genomes, Outcomes
from gaplab.services.core.registry import Presets
from gaplab.services.core.scoring import moved
from gaplab.services.core.strategies.base import Search, Strategy
from gaplab.services.core.types import Belief


class EstimationExplorationOptions(Frozen):
    """Options of the strategy `estimation_exploration`."""

    models: Annotated[int, Field(strict=True, ge=2, le=1_000)] = Field(
        default=15, description="simulators that compete; the authors': 15"
    )
    select: Literal["fittest", "disagreement"] = Field(
        default="fittest",
        description="the fittest controller in the best model, as in robotics; or the one on whose readings the best "
        "models disagree, which needs sensors",
    )
    compared: Annotated[int, Field(strict=True, ge=2, le=100)] = Field(
        default=5, description="best models that are compared, if `select` is disagreement; the authors': 5"
    )
    reliability: Annotated[float, Field(strict=True, ge=0, le=1)] = Field(
        default=0.5,
        description="weight of how little a model's readings change with its tunables, against disagreement; the "
        "authors' first: 0.5",
    )
    perturbation: Annotated[float, Field(strict=True, gt=0, lt=0.5)] = Field(
        default=0.02, description="that change of the tunables, as a share of their bounds; gaplab's default"
    )
    candidates: Annotated[int, Field(strict=True, ge=0, le=10_000)] = Field(
        default=100,
        description="random controllers to choose from, at most the evaluations of a selection; 0: a search with all "
        "of these; gaplab's default",
    )


class EstimationExploration(Strategy):
    """Competing models of the robot, and tests that are fit, or that tell the models apart.

    A test should make the models disagree, but not a model with itself after a slight change of its tunables. For the
    authors' estimation, combine it with the tuner `climbers` and the discrepancy `readings`. Do not select by
    disagreement where impacts are chaotic: models disagree most on what none of them can predict.
    """

    name = "estimation_exploration"
    source = "Bongard and Lipson 2004, 2005; Bongard, Zykov and Lipson 2006; without the bank of difficult tests"
    presets: ClassVar[Presets] = {
        "bongard_2005": {"models": 15, "select": "disagreement", "compared": 5, "reliability": 0.5},
    }
    Options = EstimationExplorationOptions
    options: EstimationExplorationOptions

    @property
    def ensemble(self) -> int:
        """Return the number of models."""
        return self.options.models

    @property
    def senses(self) -> bool:
        """Return whether it selects by readings."""
        return self.options.select == "disagreement"

    @property
    def needs_fitness(self) -> bool:
        """Return whether it selects by fitness."""
        return not self.senses

    def selection_simulators(self, tunables: int, *, learned: bool) -> int:  # noqa: ARG002 - the port's signature
        """Return one, or the compared models, with as many beside them if reliability counts."""
        compared = min(self.options.compared, self.options.models)
        return compared * (2 if self.options.reliability else 1) if self.senses else 1

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:
        """Return the fittest controller found, or the one with the most disagreement less unreliability."""
        if not self.senses:
            return search(lambda _, fitnesses: fitnesses[:, 0], parameters=belief.parameters[:1])
        models = belief.parameters[: self.options.compared]
        signs = rng.choice([-1.0, 1.0], models.shape)
        nearby = moved(models, self.options.perturbation * signs, belief.tunables)
        weight = self.options.reliability

        def score(genomes: Genomes, outcomes: Outcomes) -> FloatArray:
            readings, others = outcomes[:, : len(models), 1:], outcomes[:, len(models) :, 1:]
            scores = (1.0 - weight) * readings.std(axis=1).sum(axis=1)
            if weight:
                scores = scores - weight * np.abs(readings - others).sum(axis=(1, 2))
            return np.where(_tried(genomes, belief), np.nan, scores)

        return search(
            score,
            parameters=np.vstack([models, nearby]) if weight else models,
            senses=True,
            candidates=belief.draw(self.options.candidates, rng) if self.options.candidates else None,
        )


def _tried(genomes: Genomes, belief: Belief) -> NDArray[np.bool_]:
    """Return whether each genome is a sample, `(n,)`."""
    samples = {sample.genome.tobytes() for sample in belief.samples}
    return np.array([genome.tobytes() in samples for genome in genomes])
