"""Strategies without samples and tuning: they transfer what works in many simulators, or in spite of noise in them."""

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from numpy.random import Generator
from pydantic import BeforeValidator, Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes, Parameters
from gaplab.services.core.registry import listed
from gaplab.services.core.space import Space
from gaplab.services.core.strategies.base import Search, Untuned
from gaplab.services.core.types import Belief

EQUAL_ROLLOUTS = Field(
    default=False,
    description="divide the evaluations by the simulators, so that the search costs no more rollouts than one in a "
    "single simulator; gaplab's default: no",
)


class DomainRandomizationOptions(Frozen):
    """Options of the strategy `domain_randomization`."""

    simulators: Annotated[int, Field(strict=True, ge=1, le=1_000)] = Field(
        default=20, description="random simulators in which every controller is evaluated; gaplab's default"
    )
    equal_rollouts: bool = EQUAL_ROLLOUTS


class Drawn(Untuned):
    """A strategy whose options say in how many simulators it evaluates each controller, and at what cost."""

    options: "DomainRandomizationOptions | NoiseEnvelopeOptions"

    @property
    def ensemble(self) -> int:
        """Return the number of simulators."""
        return self.options.simulators

    @property
    def equal_rollouts(self) -> bool:
        """Return whether the evaluations are divided by the simulators."""
        return self.options.equal_rollouts


class DomainRandomization(Drawn):
    """The controller with the highest mean fitness in random simulators: no samples, no tuning.

    The simulators are drawn once from the bounds of the tunables, and stay the same during the search.
    """

    name = "domain_randomization"
    source = "Tobin et al. 2017; the number of simulators is gaplab's"
    Options = DomainRandomizationOptions
    options: DomainRandomizationOptions

    def transfer(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller with the highest mean fitness found; failed physics in one simulator rules it out."""
        return search(lambda _, fitnesses: fitnesses.mean(axis=1))


BASE = ("dynamic_friction",)


class NoiseEnvelopeOptions(Frozen):
    """Options of the strategy `noise_envelope`."""

    base: Annotated[tuple[str, ...], BeforeValidator(listed), Field(max_length=100)] = Field(
        default=BASE,
        description="tunables that a behaviour should use, by labels like mass(trunk), separated by commas: they "
        "vary little; all others vary over all their bounds; gaplab's: dynamic_friction",
    )
    epsilon: Annotated[float, Field(strict=True, ge=0, le=0.5)] = Field(
        default=0.1,
        description="largest distance of these from the middle of their bounds, as a share of the bounds; gaplab's "
        "default",
    )
    simulators: Annotated[int, Field(strict=True, ge=1, le=1_000)] = Field(
        default=8, description="draws in which every controller is evaluated; gaplab's default"
    )
    fitness: Literal["minimum", "mean_minus_deviation"] = Field(
        default="minimum", description="how the fitnesses in all draws are combined; gaplab's default: the minimum"
    )
    kappa: Annotated[float, Field(strict=True, ge=0, le=1e6)] = Field(
        default=1.0,
        description="standard deviations to subtract, if `fitness` is mean_minus_deviation; gaplab's default",
    )
    equal_rollouts: bool = EQUAL_ROLLOUTS


class NoiseEnvelope(Drawn):
    """The controller that is fit in every draw of a noisy simulator: no samples, no tuning.

    *Base* aspects vary a little around the middle of their bounds, which says nothing about reality. *Implementation*
    aspects vary so much that no behaviour can rely on them. The draws stay the same during the search.
    """

    name = "noise_envelope"
    source = "Jakobi, Husbands and Harvey 1995; Jakobi 1997; the numbers are gaplab's"
    Options = NoiseEnvelopeOptions
    options: NoiseEnvelopeOptions

    @property
    def named_tunables(self) -> tuple[str, ...]:
        """Return the base aspects, if they are not the default."""
        return self.options.base if self.options.base != BASE else ()

    def draw(self, tunables: Space, names: Sequence[str], rng: Generator) -> Parameters:
        """Return draws `(m, p)` from the envelope."""
        drawn = tunables.draw(self.ensemble, rng)
        middle = (tunables.lower + tunables.upper) / 2
        little = tunables.contain(middle + 2 * self.options.epsilon * (drawn - middle))
        return np.where(np.isin(names, self.options.base), little, drawn)

    def transfer(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller found that is fittest in its worst draw, or in its mean less deviations."""

        def score(_: Genomes, fitnesses: Fitnesses) -> FloatArray:
            if self.options.fitness == "minimum":
                return np.asarray(fitnesses.min(axis=1))
            return np.asarray(fitnesses.mean(axis=1) - self.options.kappa * fitnesses.std(axis=1))

        return search(score)
