"""Try variations of the hand-designed controller."""

from typing import Annotated

from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import Genome
from gaplab.services.core.strategies.base import Search, Strategy
from gaplab.services.core.types import Belief


class KnownFitOptions(Frozen):
    """Options of `known_fit`."""

    spread: Annotated[float, Field(strict=True, gt=0, le=1)] = Field(
        default=0.25,
        description="upper end of the uniform number from 0 that is added to each gene, as a share of its extent",
    )


class KnownFit(Strategy):
    """The robot's hand-designed controller with a uniform random number added to each gene.

    Like *random*, it needs no loop. Its samples have medium fitness, while most random ones are unfit.
    """

    name = "known_fit"
    source = "Paper, section 2, Known Fit"
    searches = False
    Options = KnownFitOptions
    options: KnownFitOptions

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the known genome plus U[0, spread] on each gene; phases wrap, widths clip."""
        space = belief.space
        return space.contain(belief.known + self.options.spread * space.extent * rng.random(space.size))
