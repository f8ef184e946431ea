"""What a strategy is: given what is believed, which controller to try in reality next."""

from abc import abstractmethod
from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Protocol, TypeAlias

from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes
from gaplab.services.core.registry import Plugin
from gaplab.services.core.types import Belief

Score: TypeAlias = Callable[[Genomes, Fitnesses], FloatArray]
"""`(n, g)` genomes and their `(n, m)` fitnesses in the believed simulators -> `(n,)`, maximised."""


class Search(Protocol):
    """A search over controllers, with the whole budget of a selection: there is one for each, and no second."""

    def __call__(self, score: Score) -> Genome:
        """The genome `(g,)` with the highest score that was found.

        Raises:
            PluginBroken: the selection has searched before, or the strategy says that it does not search.
        """
        ...


class Strategy(Plugin):
    """Selects the samples: the controllers whose evaluation in reality guides simulator tuning.

    Attributes:
        searches: its selection spends a search's budget, on one search.
        selects_transferred: its search is the transfer's: for the fittest controller in the best simulator.
        in_reality: the experiment is the direct baseline, which evolves in reality and takes no samples.
    """

    searches: ClassVar[bool] = True
    selects_transferred: ClassVar[bool] = False
    in_reality: ClassVar[bool] = False

    @property
    def ensemble(self) -> int:
        """How many simulators it wants tuned: one, or a diverse ensemble of many."""
        return 1

    @abstractmethod
    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:
        """The genome `(g,)` to try in reality next.

        Args:
            belief: the samples so far, and simulators tuned on them.
            search: finds the controller that maximises a score; a strategy that needs none does not call it.
            rng: the strategy's own randomness; the search has another.
        """

    @classmethod
    def details(cls) -> dict[str, Any]:
        """How many simulators it tunes, and whether it is the baseline."""
        return {"simulators": cls().ensemble, "baseline": cls.in_reality}


class EnsembleOptions(Frozen):
    """Options of the strategies that weigh a diverse ensemble of simulators."""

    simulators: Annotated[int, Field(strict=True, ge=2, le=1_000)] = Field(
        default=20, description="size of the diverse ensemble; the paper: 20"
    )
    least_error: Annotated[float, Field(strict=True, gt=0, le=1e6)] = Field(
        default=0.03,
        description="in the unit of fitness: simulators whose error is below this weigh alike (a floor under Σe²)",
    )
