"""Resolved specs: what the service stores and runs, with every field.

The stored JSON is that of a submitted spec. A later change of a default therefore changes no stored experiment.
"""

from typing import Annotated

from pydantic import Field, model_validator

from gaplab.schemas.base import Count, Label, Real, Seed
from gaplab.schemas.measurements import Beyond, LimitsSpec
from gaplab.schemas.plugin import PluginRef, TunableRef
from gaplab.schemas.spec import (
    BudgetName,
    BudgetSpec,
    ExperimentSpec,
    HeldOut,
    KnownSamples,
    Probes,
    RealityKind,
    RealitySpec,
    Repeats,
)

SPEC_VERSION = 1
"""Version of newly stored specs."""


class ResolvedTunable(TunableRef):
    """A simulator parameter to tune, with its bounds."""

    lower: Real
    upper: Real

    @model_validator(mode="after")
    def _check_the_bounds(self) -> "ResolvedTunable":
        if self.lower >= self.upper:
            raise ValueError(f"lower must be below upper, not {self.lower:g} and {self.upper:g}")
        return self


class ResolvedBudget(BudgetSpec):
    """The number of evaluations of each search."""

    preset: BudgetName
    controller_evaluations: Count
    selection_evaluations: Count
    simulator_evaluations: Count
    reuse_transfer: Annotated[bool, Field(strict=True)]


class ResolvedReality(RealitySpec):
    """Reality with every field; a physical one has no engine and no parameters.

    Some hidden parameters of an imported experiment may be unknown.
    """

    kind: RealityKind
    engine: PluginRef | None
    parameters: dict[str, Real]
    bench: Label | None
    repeats: Repeats
    samples: KnownSamples
    probes: Probes
    limits: LimitsSpec | None
    beyond: Beyond


class ResolvedSpec(ExperimentSpec):
    """An experiment with every field: a spec on which no default has any influence.

    A controller or a task that is null is the robot's own, as its world is.
    """

    name: Label
    iterations: Annotated[int, Field(strict=True, ge=0, le=10_000_000)]
    repetitions: Count
    robot: PluginRef
    controller: PluginRef | None
    task: PluginRef | None
    strategy: PluginRef
    optimizer: PluginRef
    controller_optimizer: PluginRef
    engine: PluginRef
    tunables: tuple[ResolvedTunable, ...]
    discrepancy: PluginRef
    tuner: PluginRef
    held_out: HeldOut
    reality: ResolvedReality
    budget: ResolvedBudget
    seed: Seed
