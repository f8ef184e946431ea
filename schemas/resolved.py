"""Resolved specs: what the service stores and runs, with every field.

The stored JSON is that of a submitted spec. A later change of a default therefore changes no stored experiment.
"""

from collections.abc import Mapping
from typing import Any

from pydantic import model_validator

from gaplab.schemas.base import Count, Label, Real, Seed
from gaplab.schemas.plugin import PluginRef, TunableRef
from gaplab.schemas.spec import BudgetName, BudgetSpec, ExperimentSpec, Probes, RealitySpec

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


class ResolvedReality(RealitySpec):
    """Reality with every field; a physical one has no engine and no parameters.

    Some hidden parameters of an imported experiment may be unknown. A spec from before there were physical realities
    has none of their fields.
    """

    engine: PluginRef | None
    parameters: dict[str, Real]
    probes: Probes = "each"


class ResolvedSpec(ExperimentSpec):
    """An experiment with every field: a spec on which no default has any influence.

    A controller or a task that is null is the robot's own, as its world is.
    """

    name: Label
    iterations: Count
    repetitions: Count
    robot: PluginRef
    strategy: PluginRef
    optimizer: PluginRef
    controller_optimizer: PluginRef
    engine: PluginRef
    tunables: tuple[ResolvedTunable, ...]
    reality: ResolvedReality
    budget: ResolvedBudget
    seed: Seed

    @model_validator(mode="before")
    @classmethod
    def _search_for_controllers_as_before(cls, value: Any) -> Any:  # noqa: ANN401 - JSON
        """Give a spec from before there was an optimizer of controllers the one that it has."""
        if isinstance(value, Mapping) and "optimizer" in value:
            return {"controller_optimizer": value["optimizer"], **value}
        return value
