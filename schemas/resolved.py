"""Resolved specs: what the service stores and runs, with every field.

The stored JSON is that of a submitted spec. A later change of a default therefore changes no stored experiment.
"""

from pydantic import model_validator

from gaplab.schemas.base import Count, Label, Real, Seed
from gaplab.schemas.plugin import PluginRef, TunableRef
from gaplab.schemas.spec import BudgetName, BudgetSpec, ExperimentSpec, RealitySpec


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


class ResolvedReality(RealitySpec):
    """Reality's engine and hidden parameters; of an imported experiment, some parameters may be unknown."""

    engine: PluginRef
    parameters: dict[str, Real]


class ResolvedSpec(ExperimentSpec):
    """An experiment with every field: a spec on which no default has any influence."""

    name: Label
    iterations: Count
    repetitions: Count
    robot: PluginRef
    strategy: PluginRef
    optimizer: PluginRef
    engine: PluginRef
    tunables: tuple[ResolvedTunable, ...]
    reality: ResolvedReality
    budget: ResolvedBudget
    seed: Seed
