"""Errors of the API; and mistakes that pydantic finds, in words: the place, what is permitted there, and the value."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pydantic import Field

from gaplab.schemas.base import TAG_PATTERN, Frozen

LONGEST_VALUE = 60
"""Most characters of a value in a sentence."""

PERMITTED = {
    **dict.fromkeys(("int_type", "int_parsing", "int_from_float"), "a whole number"),
    "int_parsing_size": "a whole number with fewer digits",
    **dict.fromkeys(("float_type", "float_parsing", "finite_number"), "a finite number"),
    "string_type": "text",
    **dict.fromkeys(("bool_type", "bool_parsing"), "true or false"),
    **dict.fromkeys(("dict_type", "model_type", "dataclass_type", "model_attributes_type"), "an object"),
    "name_type": "a name or an object",
    **dict.fromkeys(("tuple_type", "list_type"), "a list"),
    "greater_than": "above {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "below {lt}",
    "less_than_equal": "at most {le}",
    "too_short": "at least {min_length}",
    "too_long": "at most {max_length}",
    "string_too_short": "at least {min_length} characters",
    "string_too_long": "at most {max_length} characters",
}
"""What is permitted, by pydantic's type of error."""

PATTERNS = {TAG_PATTERN: "letters, digits and _ . : / + -, the first a letter or a digit"}
"""What is permitted, by the pattern that a text must match."""

LENGTHS = {
    "too_short": ("at least", "min_length", "item"),
    "too_long": ("at most", "max_length", "item"),
    "string_too_short": ("at least", "min_length", "character"),
    "string_too_long": ("at most", "max_length", "character"),
}
"""Bound, limit and unit of a length, by pydantic's type of error."""


def pointer_to(path: Iterable[object]) -> str:
    """Return the JSON pointer (RFC 6901) of a place, given the names and numbers on the way to it."""
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in path)


def within(body: object, path: Sequence[str | int]) -> Sequence[str | int]:
    """Return as much of the path as exists in the body, where `"smoke"` may be short for `{"preset": "smoke"}`."""
    for depth, part in enumerate(path):
        if isinstance(body, Mapping):
            body = body.get(part)
        elif isinstance(body, list | tuple) and isinstance(part, int) and part < len(body):
            body = body[part]
        else:
            return path[:depth]
    return path


def permitted_by(error: Mapping[str, Any]) -> tuple[str, ...] | str | None:
    """Return what is permitted instead of the refused value: a description, or all permitted texts."""
    context = error.get("ctx", {})
    if error["type"] in {"literal_error", "enum"}:
        return tuple(re.findall(r"'([^']*)'", context["expected"]))
    if error["type"] == "string_pattern_mismatch":
        return PATTERNS.get(context["pattern"])
    template = PERMITTED.get(error["type"])
    return template.format(**context) if template else None


def sentence(error: Mapping[str, Any], place: Sequence[str | int] | None = None) -> str:
    """Return an error of pydantic as a sentence without a full stop.

    Args:
        error: an item of `ValidationError.errors()`.
        place: names and numbers that lead to the value; left out: `loc` of the error.
    """
    kind, context = error["type"], error.get("ctx", {})
    subject = _subject(error["loc"] if place is None else place)
    if kind == "missing":
        return f"{subject} is missing"
    if kind in LENGTHS:
        bound, limit, unit = LENGTHS[kind]
        items = f"{context[limit]} {unit}{'' if context[limit] == 1 else 's'}"
        return f"{subject} must have {bound} {items}{_not_length(error)}"
    permitted = permitted_by(error)
    if permitted is None and kind == "string_pattern_mismatch":
        return f"{subject} must match {context['pattern']}{_not(error)}"
    if permitted is None:
        return str(error["msg"]).removeprefix("Value error, ").removeprefix("Assertion failed, ")
    return f"{subject} must be {permitted if isinstance(permitted, str) else _one_of(permitted)}{_not(error)}"


def _subject(place: Sequence[str | int]) -> str:
    """Return the subject of a sentence on a value: its field, with the number of a list item; "it" for a whole body."""
    names = [part for part in place if isinstance(part, str)]
    if not names:
        return "it"
    return f"item {place[-1]} of {names[-1]}" if isinstance(place[-1], int) else names[-1]


def _one_of(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"one of {', '.join(names)}"


def _not_length(error: Mapping[str, Any]) -> str:
    given = error.get("input")
    length = error.get("ctx", {}).get("actual_length", len(given) if isinstance(given, str) else None)
    return "" if length is None else f", not {length:,}"


def _not(error: Mapping[str, Any]) -> str:
    """Return the refused value, shortened; nothing if the error does not have it."""
    if "input" not in error:
        return ""
    try:
        value = json.dumps(error["input"], ensure_ascii=False, default=str)
    except (ValueError, RecursionError):
        return ""
    return f", not {value if len(value) <= LONGEST_VALUE else f'{value[:LONGEST_VALUE]}…'}"


class SpecError(Frozen):
    """One error in a request."""

    pointer: str = Field(
        description="JSON pointer into the body, or the name of a query or path parameter", examples=["/robot"]
    )
    value: Any = Field(None, description="the offending value, as sent")
    message: str = Field(
        examples=["unknown robot 'quadrupet' (did you mean 'quadruped'?); permitted: quadruped, toy_function"]
    )
    permitted: tuple[str, ...] | str | None = None
    nearest: str | None = None


class Problem(Frozen):
    """The reason why a request failed, sent as `application/problem+json`."""

    type: str = Field(examples=["urn:gaplab:problem:not-found"])
    title: str = Field(examples=["Not found"])
    status: int = Field(examples=[404])
    detail: str = Field(examples=["there is nothing with the id 'x'"])
    errors: tuple[SpecError, ...] = ()
