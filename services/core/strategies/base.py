"""The contract of a strategy: from beliefs to the next controller to try in reality."""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, Protocol, TypeAlias

from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes
from gaplab.services.core.registry import Plugin
from gaplab.services.core.scoring import NO_FLOOR
from gaplab.services.core.types import Belief

Score: TypeAlias = Callable[[Genomes, Fitnesses], FloatArray]
"""A function from genomes `(n, g)` and their fitnesses `(n, m)` in the tuned simulators to scores `(n,)`, maximised."""


class Search(Protocol):
    """A search over controllers, with the whole budget of a selection; it can be called once."""

    def __call__(self, score: Score) -> Genome:
        """Return the genome `(g,)` with the highest score found.

        Raises:
            PluginBroken: the selection has searched before, or the strategy has `searches = False`.
        """
        ...


class Strategy(Plugin):
    """Selects the samples: the controllers whose evaluation in reality guides tuning.

    Attributes:
        searches: true if a selection searches, which spends its budget.
        selects_transferred: true if its search has the transfer's goal, the fittest controller in the best simulator.
        in_reality: true for the direct baseline, which evolves in reality and takes no samples.
        published: options of the formula as its source prints it, which the preset `as_published` sets.
    """

    searches: ClassVar[bool] = True
    selects_transferred: ClassVar[bool] = False
    in_reality: ClassVar[bool] = False
    published: ClassVar[Mapping[str, Any]] = {}

    @property
    def ensemble(self) -> int:
        """Return the number of simulators to tune: one, or a diverse ensemble."""
        return 1

    @abstractmethod
    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:
        """Return the next genome `(g,)` to try in reality.

        Args:
            belief: samples so far, and simulators tuned on them.
            search: finds the controller that maximises a score; optional.
            rng: random generator of the strategy; the search has its own.
        """

    @classmethod
    def details(cls) -> dict[str, Any]:
        """Return the number of simulators and whether this is the baseline, for the catalogue."""
        return {"simulators": cls().ensemble, "baseline": cls.in_reality}


EnsembleSize = Annotated[int, Field(strict=True, ge=2, le=1_000)]


class DiverseOptions(Frozen):
    """Options of strategies that weight a diverse ensemble of simulators by their accuracy."""

    simulators: EnsembleSize = Field(default=20, description="size of the diverse ensemble; the paper: 20")
    least_share: Annotated[float, Field(strict=True, ge=0, le=1_000)] = Field(
        default=0.03,
        description="simulators with a smaller error have equal weight (a floor under Σe²), as a share of about the "
        "fitness of `direct`; errors of readings have the noise of the sensors instead",
    )
    least_error: Annotated[float, Field(strict=True, ge=0, le=1e6)] | None = Field(
        default=None,
        description="the same in the unit of the error: of fitness, or the noise of readings; 0: no floor, as in the "
        "paper; null: `least_share` counts",
    )

    def floor(self, belief: Belief) -> float:
        """Return the floor under the discrepancies of simulators, above 0."""
        error, discrepancy = self.least_error, belief.discrepancy
        if error is None:
            error = discrepancy.least_error(self.least_share * belief.scale)
        return max(discrepancy.floor(error), NO_FLOOR)


class EnsembleOptions(Frozen):
    """Options of strategies of your own that square `least_error` themselves; `DiverseOptions` has no units."""

    simulators: EnsembleSize = Field(default=20, description="size of the diverse ensemble; the paper: 20")
    least_error: Annotated[float, Field(strict=True, gt=0, le=1e6)] = Field(
        default=0.03,
        description="simulators with a smaller error have equal weight (a floor under Σe²), in the unit of fitness",
    )
