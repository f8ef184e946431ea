"""Try a controller by a weighted sum of all that makes a sample worthwhile."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.services.core.arrays import FloatArray, Genome, Genomes, Outcomes, Parameters
from gaplab.services.core.registry import Presets
from gaplab.services.core.scoring import (
    beside,
    fisher_information,
    log_determinant,
    moved,
    scaled_uniqueness_penalty,
    trace,
    weighted_deviation,
    weighted_mean,
    weights_of,
)
from gaplab.services.core.strategies.base import Diverse, DiverseOptions, Search, Weight
from gaplab.services.core.types import Belief


class WeightedOptions(DiverseOptions):
    """Weights of the terms, all gaplab's defaults; a term of weight 0 costs nothing."""

    fit_weight: Weight = Field(default=1.0, description="weight of the mean simulated fitness; gaplab's default")
    disagreement_weight: Weight = Field(
        default=1.0, description="weight of the standard deviation of simulated fitness; gaplab's default"
    )
    uniqueness_weight: Weight = Field(
        default=0.0, description="weight of the distance from earlier samples; gaplab's default: none"
    )
    reliability_weight: Weight = Field(
        default=0.0,
        description="weight of how little fitness changes with the tunables of each simulator; doubles the simulators; "
        "gaplab's default: none",
    )
    information_weight: Weight = Field(
        default=0.0,
        description="weight of the Fisher information about the tunables, from the slopes of readings, or of fitness "
        "without sensors; one more simulator for each tunable; gaplab's default: none",
    )
    information: Literal["log_determinant", "trace"] = Field(
        default="log_determinant",
        description="number that stands for the Fisher information; one sensitive tunable can dominate the trace; "
        "gaplab's default",
    )
    normalise: bool = Field(
        default=True,
        description="divide each term by its standard deviation over the first population of the search, so that "
        "weights have no unit; gaplab's default",
    )
    perturbation: Annotated[float, Field(strict=True, gt=0, lt=0.5)] = Field(
        default=0.02, description="change of the tunables for reliability, as a share of their bounds; gaplab's default"
    )
    difference: Annotated[float, Field(strict=True, gt=0, lt=0.5)] = Field(
        default=0.1, description="change of the tunables for the slopes, as a share of their bounds; ASID's: 0.1"
    )
    transfer: Literal["best", "mean"] = Field(
        default="best",
        description="the fittest in the best simulator; or the highest mean fitness over the ensemble, weighted by "
        "accuracy, as SimOpt does with draws: as many rollouts an evaluation as simulators",
    )


class Weighted(Diverse):
    """The controller with the highest weighted sum of fitness, disagreement, uniqueness, reliability and information.

    With `normalise` off, the first three weights give the scores of *simulated fit and informative* and, up to a
    factor, of *simulated fit and unique*.
    """

    name = "weighted"
    source = "Paper, section 4, proposes weights; Fisher information: ASID 2024; reliability: Bongard and Lipson 2005"
    presets: ClassVar[Presets] = {
        **Diverse.presets,
        "asid_2024": {
            "fit_weight": 0.0,
            "disagreement_weight": 0.0,
            "information_weight": 1.0,
            "information": "trace",
            "difference": 0.1,
        },
        "chebotar_2019": {"disagreement_weight": 0.0, "normalise": False, "transfer": "mean"},
    }
    Options = WeightedOptions
    options: WeightedOptions

    @property
    def needs_fitness(self) -> bool:
        """Return whether a term besides Fisher information counts, since the others are of fitness."""
        return self._compared(2) > 1 or self.options.uniqueness_weight > 0

    def selection_simulators(self, tunables: int, *, learned: bool) -> int:
        """Return the simulators that count, and those beside them that reliability and information need."""
        compared = self._compared(super().selection_simulators(tunables, learned=learned))
        nearby = compared if self.options.reliability_weight else 0
        return compared + nearby + (tunables if self.options.information_weight else 0)

    def transfer_simulators(self, tunables: int) -> int:  # noqa: ARG002 - the port's signature
        """Return one, or the ensemble if its mean counts."""
        return self.ensemble if self.options.transfer == "mean" else 1

    def transfer(self, belief: Belief, search: Search, rng: Generator) -> Genome:
        """Return the fittest controller found in the best simulator, or that of the highest weighted mean fitness."""
        if self.options.transfer == "best":
            return super().transfer(belief, search, rng)
        weights = weights_of(belief.simulators, self.options.floor(belief))
        return search(lambda _, fitnesses: weighted_mean(fitnesses, weights))

    def _compared(self, simulators: int) -> int:
        """Return how many of these simulators count: all, or the best alone."""
        options = self.options
        weights = (options.fit_weight, options.disagreement_weight, options.reliability_weight)
        return simulators if any(weights) else 1

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:
        """Return the controller with the highest weighted sum found."""
        options, senses, belief = self.options, self.options.information_weight > 0, self.options.weighed(belief)
        asked = self._asked(belief, rng)
        divisors: dict[str, float] = {}

        def score(genomes: Genomes, found: FloatArray) -> FloatArray:
            total = np.zeros(len(genomes))
            for name, values in self._terms(genomes, found if senses else found[..., None], asked, belief):
                divisor = divisors.setdefault(name, _deviation(values) if options.normalise else 1.0)
                total = total + getattr(options, f"{name}_weight") * values / divisor
            return total

        return search(score, parameters=np.vstack([asked.models, asked.nearby, asked.aside]), senses=senses)

    def _asked(self, belief: Belief, rng: Generator) -> "_Asked":
        options, models = self.options, belief.parameters[: self._compared(self.ensemble)]
        steps = options.perturbation * rng.choice([-1.0, 1.0], models.shape)
        nearby = moved(models, steps, belief.tunables) if options.reliability_weight else models[:0]
        aside = beside(models[0], options.difference, belief.tunables) if options.information_weight else models[:0]
        return _Asked(models, nearby, aside)

    def _terms(
        self, genomes: Genomes, outcomes: Outcomes, asked: "_Asked", belief: Belief
    ) -> Iterator[tuple[str, FloatArray]]:
        """Yield the name and the values `(n,)` of each term whose weight is above 0."""
        options, count = self.options, len(asked.models)
        weights = weights_of(belief.simulators[:count], options.floor(belief))
        fitnesses = outcomes[:, :count, 0]
        if options.fit_weight:
            yield "fit", weighted_mean(fitnesses, weights)
        if options.disagreement_weight:
            yield "disagreement", weighted_deviation(fitnesses, weights)
        if options.uniqueness_weight:
            yield "uniqueness", -scaled_uniqueness_penalty(genomes, fitnesses[:, 0], belief)
        if options.reliability_weight:
            nearby = outcomes[:, count : count + len(asked.nearby), 0]
            yield "reliability", -weighted_mean(np.abs(nearby - fitnesses), weights)
        if options.information_weight:
            best = np.concatenate([outcomes[:, :1], outcomes[:, count + len(asked.nearby) :]], axis=1)
            seen = best[..., 1:] if best.shape[-1] > 1 else best
            information = fisher_information(seen, np.vstack([asked.models[:1], asked.aside]), belief.tunables)
            yield "information", {"log_determinant": log_determinant, "trace": trace}[options.information](information)


@dataclass(frozen=True)
class _Asked:
    """The simulators in which each controller is evaluated.

    Attributes:
        models: `(k, p)`, tuned ones.
        nearby: `(k, p)`, these after a slight change; `(0, p)` without reliability.
        aside: `(p, p)`, the best with one tunable after another changed; `(0, p)` without information.
    """

    models: Parameters
    nearby: Parameters
    aside: Parameters


def _deviation(values: FloatArray) -> float:
    """Return the standard deviation of the finite values; 1 if they do not vary."""
    there = values[np.isfinite(values)]
    deviation = float(there.std()) if len(there) else 0.0
    return deviation if deviation > 0 else 1.0
