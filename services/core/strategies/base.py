"""The contract of a strategy: from beliefs to the controllers to try in reality."""

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Protocol, TypeAlias

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Genome, Genomes, Parameters
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.registry import Plugin, Presets
from gaplab.services.core.repeats import variance_of_mean
from gaplab.services.core.scoring import NO_FLOOR, weights_of
from gaplab.services.core.space import Space
from gaplab.services.core.types import Belief, Sample

Score: TypeAlias = Callable[[Genomes, FloatArray], FloatArray]
"""A function from genomes `(n, g)` and their fitnesses `(n, m)` in the simulators to scores `(n,)`, maximised.

For an optimizer with several objectives, it may return `(n, o)`.

A search with readings gives it outcomes `(n, m, 1 + q)`: fitness, then readings.
"""


class Search(Protocol):
    """A search over controllers, with the whole budget of a selection or a transfer; it can be called once."""

    @property
    def members(self) -> Genomes:
        """Return the final population `(n, g)` of its optimizer, best first; none before, and none of candidates."""
        ...

    def __call__(
        self,
        score: Score,
        *,
        parameters: Parameters | None = None,
        senses: bool = False,
        candidates: Genomes | None = None,
        start: Genomes | None = None,
    ) -> Genome:
        """Return the genome `(g,)` with the highest score found; of several scores, the first counts.

        Args:
            score: what to maximise; a score that is not finite never wins.
            parameters: `(m, p)`, the simulators to search in; default: all that were tuned.
            senses: true if the score needs `(n, m, 1 + q)`: fitness, then q readings; 0 of a robot without sensors.
            candidates: `(n, g)`, the only genomes to evaluate, as far as the budget goes; default: the optimizer's.
            start: `(n, g)`, genomes that the optimizer is given first; they count.

        Raises:
            PluginBroken: the budget is spent, or an evaluation needs more simulators than the strategy states.
        """
        ...


class Strategy(Plugin):
    """Selects the samples: the controllers whose evaluation in reality guides tuning; then transfers a controller.

    Attributes:
        searches: true if a selection searches, which spends its budget.
        selects_transferred: true if its search has the transfer's goal, the fittest controller in the best simulator.
        takes_samples: false if it tunes nothing and transfers one controller at once; its curve is a horizontal line.
        in_reality: true for the direct baseline, which evolves in reality and takes no samples.
        tunes: false if the first simulators stay, at no cost; the transfer is searched anew after each sample.
        continues: true if the final populations of its searches are kept, so that the next one can go on from
            `Belief.members`.
        controller_optimizer: name of the optimizer that searches for its controllers if the spec names none; None:
            that of the spec. If it has several objectives, an optimizer with a single one is refused.
    """

    searches: ClassVar[bool] = True
    selects_transferred: ClassVar[bool] = False
    takes_samples: ClassVar[bool] = True
    in_reality: ClassVar[bool] = False
    tunes: ClassVar[bool] = True
    continues: ClassVar[bool] = False
    controller_optimizer: ClassVar[str | None] = None

    @property
    def ensemble(self) -> int:
        """Return the number of simulators to tune: one, or a diverse ensemble."""
        return 1

    @property
    def senses(self) -> bool:
        """Return whether it cannot do without readings, so that a robot without sensors is refused."""
        return False

    @property
    def needs_fitness(self) -> bool:
        """Return whether it selects by fitness, so that a recorded reality, which has none, is refused."""
        return self.takes_samples

    @property
    def equal_rollouts(self) -> bool:
        """Return whether a search costs as many rollouts as one in a single simulator, by fewer evaluations."""
        return False

    @property
    def named_tunables(self) -> tuple[str, ...]:
        """Return the tunables that lists of its options name, by label; a spec that does not tune them is refused."""
        return ()

    def selection_simulators(self, tunables: int, *, learned: bool) -> int:  # noqa: ARG002 - for those that need it
        """Return the most simulators that an evaluation of a selection needs, by default all that are tuned.

        Args:
            tunables: number of tunables.
            learned: whether a sample has made the weights of simulators differ.
        """
        return self.ensemble

    def transfer_simulators(self, tunables: int) -> int:  # noqa: ARG002 - for those that need it
        """Return the most simulators that an evaluation of a transfer needs, given the number of tunables."""
        return 1

    def draw(self, tunables: Space, names: Sequence[str], rng: Generator) -> Parameters:  # noqa: ARG002 - the port's
        """Return the simulators `(m, p)` before the first sample, by default drawn uniformly.

        Args:
            tunables: bounds of the p tunables.
            names: their names.
            rng: random generator of these draws.
        """
        return tunables.draw(self.ensemble, rng)

    @abstractmethod
    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:
        """Return the next genome `(g,)` to try in reality.

        Args:
            belief: samples so far, and simulators tuned on them.
            search: finds the controller that maximises a score; optional.
            rng: random generator of the strategy; the search has its own.
        """

    def transfer(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Return the genome `(g,)` to transfer to reality, by default the fittest found in the best simulator.

        Arguments are as of `select`.
        """
        return search(lambda _, fitnesses: fitnesses[:, 0], parameters=belief.parameters[:1])

    def lessons(self, samples: Sequence[Sample]) -> Sequence[Sample]:
        """Return the samples that simulators are tuned on, by default all; it depends on the samples alone.

        After a sample that is not among its own lessons, the simulators stay, and the transferred controller and its
        probe too, at no cost; but a transfer that asks no simulator is made anew.
        """
        return samples

    @classmethod
    def details(cls) -> dict[str, Any]:
        """Return the number of simulators, and whether it takes samples or is the baseline, for the catalogue."""
        return {"simulators": cls().ensemble, "takes_samples": cls.takes_samples, "baseline": cls.in_reality}


class Untuned(Strategy):
    """A strategy without samples: a controller that evolves in simulators that nothing tunes is transferred once."""

    searches = False
    takes_samples = False

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:  # noqa: ARG002 - the port's signature
        """Refuse, because there is nothing to select."""
        raise PluginBroken(f"strategy {self.name!r} takes no samples, so it selects no controller")

    def transfer_simulators(self, tunables: int) -> int:  # noqa: ARG002 - the port's signature
        """Return the number of all its simulators."""
        return self.ensemble

    @abstractmethod
    def transfer(self, belief: Belief, search: Search, rng: Generator) -> Genome:
        """Return the genome `(g,)` to transfer to reality."""


EnsembleSize = Annotated[int, Field(strict=True, ge=2, le=1_000)]
Weight = Annotated[float, Field(strict=True, ge=0, le=1e6)]


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
    weightiest: EnsembleSize | None = Field(
        default=None,
        description="selections evaluate controllers in so many simulators of most weight alone; before any sample, "
        "when all weigh the same, in all; null: always in all, as in the paper",
    )

    def weighed(self, belief: Belief) -> Belief:
        """Return the belief with the simulators in which a selection searches; of equal weights, the first ones."""
        if self.weightiest is None or not belief.learnable:
            return belief
        weights = weights_of(belief.simulators, self.floor(belief))
        chosen = sorted(np.argsort(-weights, kind="stable")[: self.weightiest].tolist())
        return replace(belief, simulators=tuple(belief.simulators[index] for index in chosen))

    def floor(self, belief: Belief) -> float:
        """Return the floor under the discrepancies of simulators, above 0, and at least the noise of repeats."""
        error, discrepancy = self.least_error, belief.discrepancy
        if error is None:
            error = discrepancy.least_error(self.least_share * belief.scale)
        noise = 0.0 if discrepancy.senses else variance_of_mean(belief.learnable) ** 0.5
        return max(discrepancy.floor(max(error, noise)), NO_FLOOR)


class Diverse(Strategy):
    """A strategy that selects by a diverse ensemble of simulators, weighted by their accuracy."""

    presets: ClassVar[Presets] = {"lean": {"weightiest": 10}}
    Options = DiverseOptions
    options: DiverseOptions

    @property
    def ensemble(self) -> int:
        """Return the size of the diverse ensemble."""
        return self.options.simulators

    def selection_simulators(self, tunables: int, *, learned: bool) -> int:  # noqa: ARG002 - the port's signature
        """Return the size of the ensemble, or the number of simulators that count once they differ in weight."""
        return min(self.ensemble, self.options.weightiest or self.ensemble) if learned else self.ensemble
