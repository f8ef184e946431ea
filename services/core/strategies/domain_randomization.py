"""Transfer what works in many random simulators."""

from typing import Annotated

from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import Genome
from gaplab.services.core.strategies.base import Search, Untuned
from gaplab.services.core.types import Belief


class DomainRandomizationOptions(Frozen):
    """Options of `domain_randomization`."""

    simulators: Annotated[int, Field(strict=True, ge=1, le=1_000)] = Field(
        default=20, description="random simulators in which every controller is evaluated; gaplab's default"
    )
    equal_rollouts: bool = Field(
        default=False,
        description="divide the evaluations by the simulators, so that the search costs no more rollouts than one in a "
        "single simulator; gaplab's default: no",
    )


class DomainRandomization(Untuned):
    """The controller with the highest mean fitness in random simulators: no samples, no tuning.

    The simulators are drawn once from the bounds of the tunables, and stay the same during the search.
    """

    name = "domain_randomization"
    source = "Tobin et al. 2017; the number of simulators is gaplab's"
    Options = DomainRandomizationOptions
    options: DomainRandomizationOptions

    @property
    def ensemble(self) -> int:
        """Return the number of random simulators."""
        return self.options.simulators

    @property
    def equal_rollouts(self) -> bool:
        """Return whether the evaluations are divided by the simulators."""
        return self.options.equal_rollouts

    def transfer(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the controller with the highest mean fitness found; failed physics in one simulator rules it out."""
        return search(lambda _, fitnesses: fitnesses.mean(axis=1))
