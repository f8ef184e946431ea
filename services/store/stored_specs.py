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
    return json.dumps({name: spec[name] for name in ("robot", "engine", "controller", "task", "tunables")})


def without_truth(spec: Mapping[str, Any]) -> dict[str, Any]:
    """Return the spec with null in place of each of reality's parameters."""
    reality = spec["reality"]
    return {**spec, "reality": reality | {"parameters": dict.fromkeys(reality["parameters"])}}
