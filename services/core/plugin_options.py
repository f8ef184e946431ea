"""Options of a plug-in as specs have them: their names, and what is wrong with refused ones."""

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from gaplab.schemas.mistakes import permitted_by, pointer_to, sentence
from gaplab.services.core.errors import Violation, unknown_name


def given_names(options: type[BaseModel]) -> list[str]:
    """Return the names of the options, as specs have them."""
    return [field.alias or name for name, field in options.model_fields.items()]


def option_violation(name: str, options: type[BaseModel], error: Mapping[str, Any], pointer: str = "") -> Violation:
    """Return the violation of an option that the model refuses.

    Args:
        name: the plug-in's name.
        options: model of its options.
        error: an item of `ValidationError.errors()`.
        pointer: place of the options in the spec.
    """
    place = pointer_to(error["loc"])
    if error["type"] == "extra_forbidden":
        kind = f"option of {name!r}"
        return unknown_name(pointer + place, kind, str(error["loc"][-1]), given_names(options) or ["none"])
    return Violation(pointer + place, error["input"], sentence(error), permitted_by(error))
