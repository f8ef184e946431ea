"""Resolved specs as they are stored: plain JSON."""

import json
from collections.abc import Mapping
from typing import Any

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.sensitivity import Checked
from gaplab.services.core.discrepancies import discrepancies
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.discrepancies.fitness import SquaredFitness
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


def checked(spec: Mapping[str, Any]) -> Checked:
    """Return the subject of a sensitivity check of this resolved spec."""
    return Checked.model_validate_json(subject(spec))


def subject(spec: Mapping[str, Any]) -> str:
    """Return, as JSON, what a sensitivity check of this resolved spec is about."""
    return json.dumps({name: spec[name] for name in ("robot", "engine", "controller", "task", "tunables")})


def without_truth(spec: Mapping[str, Any]) -> dict[str, Any]:
    """Return the spec with null in place of each of reality's parameters."""
    reality = spec["reality"]
    return {**spec, "reality": reality | {"parameters": dict.fromkeys(reality["parameters"])}}
