"""Stored specs, as they are read."""

from collections.abc import Mapping
from typing import Any

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.discrepancies import discrepancies
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.discrepancies.squared_fitness import SquaredFitness
from gaplab.services.core.errors import InvalidSpec


def spec_of(stored: Mapping[str, Any]) -> ResolvedSpec:
    """Return a stored spec for reading, not for running: without the parameters of reality that are null."""
    reality = stored["reality"]
    known = {name: value for name, value in reality["parameters"].items() if value is not None}
    return ResolvedSpec.model_validate({**stored, "reality": {**reality, "parameters": known}})


def discrepancy_of(spec: Mapping[str, Any]) -> Discrepancy:
    """Return what the tuning of a stored spec minimises; of one that is not installed, the squared difference."""
    try:
        return discrepancies.create(PluginRef.model_validate(spec["discrepancy"]))
    except InvalidSpec:
        return SquaredFitness()
