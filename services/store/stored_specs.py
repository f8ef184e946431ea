"""Resolved specs as they are stored: plain JSON."""

import json
from collections.abc import Mapping
from typing import Any

from gaplab.schemas.sensitivity import Checked


def checked(spec: Mapping[str, Any]) -> Checked:
    """Return the subject of a sensitivity check of this resolved spec."""
    return Checked.model_validate_json(subject(spec))


def subject(spec: Mapping[str, Any]) -> str:
    """Return, as JSON, what a sensitivity check of this resolved spec is about."""
    own = {name: spec[name] for name in ("controller", "task") if spec.get(name)}
    return json.dumps({name: spec[name] for name in ("robot", "engine", "tunables")} | own)


LATER: Mapping[str, Any] = {
    "controller": None,
    "task": None,
    "discrepancy": {"name": "squared_fitness", "options": {}},
    "tuner": {"name": "search", "options": {}},
}
"""Fields that were added to specs, with what an earlier spec means without them."""


LATER_IN_REALITY: Mapping[str, Any] = {
    "kind": "simulated",
    "bench": None,
    "repeats": 1,
    "samples": [],
    "probes": "each",
    "limits": None,
    "beyond": "warn",
}
"""Fields of reality that specs have had since it may be physical, with what an earlier spec means without them."""


def complete(spec: Mapping[str, Any]) -> dict[str, Any]:
    """Return the spec with every field, also if it was stored before a field was added."""
    later = {**LATER, "controller_optimizer": spec["optimizer"]}
    return {**later, **spec, "reality": {**LATER_IN_REALITY, **spec["reality"]}}


def without_truth(spec: Mapping[str, Any]) -> dict[str, Any]:
    """Return the spec with null in place of each of reality's parameters."""
    reality = spec["reality"]
    return {**spec, "reality": reality | {"parameters": dict.fromkeys(reality["parameters"])}}
