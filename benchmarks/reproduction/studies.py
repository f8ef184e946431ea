"""The values of a stored study, by strategy."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.reproduction.paper import ITERATIONS, STRATEGIES
from gaplab.schemas.curves import Curve
from gaplab.schemas.records import ExperimentRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.comparisons import Compared, Range
from gaplab.services.core.statistics import finite
from gaplab.services.core.strategies import strategies


@dataclass(frozen=True, eq=False)
class Arm:
    """One experiment of a study.

    Attributes:
        read: the experiment, as the API returns it.
        spec: its resolved spec.
        recorded: recorded fitness `(r, k)` by repetition and number of real-world evaluations; nan is missing.
        transferred: fitness `(r, k)` in reality of the transferred controllers alone; nan if it failed or is missing.
        seconds: seconds of computation in its recorded steps.
        attempts: number of attempts at its repetitions.
        held_s: seconds from the beginnings to the ends of the attempts.
    """

    read: ExperimentRead
    spec: ResolvedSpec
    recorded: FloatArray
    transferred: FloatArray
    seconds: float
    attempts: int
    held_s: float

    @property
    def strategy(self) -> str:
        """Return the name of its strategy."""
        return self.spec.strategy.name

    @property
    def engines(self) -> set[str]:
        """Return the names of the engines of its simulators and its reality."""
        reality = self.spec.reality.engine
        return {self.spec.engine.name, *([reality.name] if reality else [])}

    @property
    def cores(self) -> int:
        """Return the cores of one rollout: the threads of the engine that runs it, or 1."""
        engine = self.spec.reality.engine if self.read.direct else self.spec.engine
        return int(engine.options.get("threads", 1)) if engine else 1

    @property
    def core_hours(self) -> float:
        """Return hours of computation in recorded steps, times cores."""
        return self.seconds * self.cores / 3600

    @property
    def held_core_hours(self) -> float:
        """Return hours of all attempts, times cores: also work that was lost, and waiting for a core."""
        return self.held_s * self.cores / 3600

    @property
    def repetitions(self) -> int:
        """Return the complete repetitions."""
        return int(np.isfinite(self.recorded[:, -1]).sum())

    @property
    def last(self) -> int:
        """Return the number of real-world evaluations of a complete repetition."""
        return int(self.recorded.shape[1]) - 1

    @property
    def selection(self) -> int | None:
        """Return the evaluations of the search for a sample; None without a search."""
        kind, budget = strategies[self.strategy], self.spec.budget
        if not kind.searches:
            return None
        reused = budget.reuse_transfer and kind.selects_transferred
        return budget.controller_evaluations if reused else budget.selection_evaluations

    def values(self, first: int, last: int) -> FloatArray:
        """Return the mean `(r,)` of each repetition over a range of evaluations, without incomplete repetitions."""
        return finite(Range(first, last).values(self.compared()))

    def compared(self) -> Compared:
        """Return the experiment as the core compares it."""
        level = self.recorded.shape[1] == 1
        return Compared(self.read.id, self.strategy, self.recorded, level, self.spec.seed, self.strategy)


@dataclass(frozen=True, eq=False)
class Study:
    """A stored study.

    Attributes:
        archives: its files; several if its experiments were computed apart.
        name: its name.
        arms: its experiments, in their order.
        curves: their curves.
    """

    archives: tuple[Path, ...]
    name: str
    arms: tuple[Arm, ...]
    curves: tuple[Curve, ...]

    @property
    def present(self) -> tuple[str, ...]:
        """Return the paper's strategies that it has, in the paper's order."""
        return tuple(name for name in STRATEGIES if self.arm(name))

    @property
    def last(self) -> int:
        """Return the last planned number of evaluations that the paper's strategies share, up to the paper's ten."""
        return min([ITERATIONS, *(arm.last for name in self.present if (arm := self.arm(name)))])

    @property
    def whole(self) -> bool:
        """Return whether it has all of the paper's strategies, samples and direct."""
        return self.present == STRATEGIES and self.last == ITERATIONS and bool(len(self.direct))

    @property
    def direct(self) -> FloatArray:
        """Return the fitness `(r,)` of the direct baseline; empty without it."""
        return next((finite(arm.recorded[:, 0]) for arm in self.arms if arm.read.direct), np.empty(0))

    @property
    def unit(self) -> float:
        """Return the mean fitness of the direct baseline; nan without it."""
        return float(self.direct.mean()) if len(self.direct) else float("nan")

    def arm(self, strategy: str) -> Arm | None:
        """Return the experiment of a strategy, the first of several; None if the study has none."""
        return next((arm for arm in self.arms if arm.strategy == strategy), None)

    def values(self, strategy: str, first: int, last: int) -> FloatArray:
        """Return the mean `(r,)` of each repetition over a range of evaluations, without incomplete repetitions."""
        arm = self.arm(strategy)
        return arm.values(first, last) if arm else np.empty(0)

    def complete(self, strategy: str, first: int, last: int) -> FloatArray:
        """Return the values `(r, k)` of the complete repetitions at each number of evaluations of a range."""
        arm = self.arm(strategy)
        found = arm.recorded[:, first : last + 1] if arm else np.empty((0, last + 1 - first))
        return found[np.isfinite(found).all(axis=1)]

    def unequal(self, names: Iterable[str]) -> str | None:
        """Return how the searches for a sample of these strategies differ in size; None if they do not."""
        arms = [arm for name in names if (arm := self.arm(name))]
        sizes = {arm.strategy: arm.selection for arm in arms if arm.selection is not None}
        if len(set(sizes.values())) < 2:
            return None
        told = ", ".join(f"{name} {size:,}" for name, size in sizes.items())
        return f"samples are selected from searches of unequal size ({told} evaluations)"
