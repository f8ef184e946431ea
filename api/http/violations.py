"""What is wrong with a request, in words: the place, the value, what is permitted, and the nearest name that exists."""

import math
import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from itertools import islice
from types import UnionType
from typing import Any, Union, get_args, get_origin

from fastapi import Request
from pydantic import BaseModel

from gaplab.schemas.problems import SpecError
from gaplab.services.core.errors import Violation

MOST_ERRORS = 50
"""Errors that one answer carries; nobody reads more, and a hostile body could cause thousands."""

PERMITTED = {
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a finite number",
    "float_parsing": "a finite number",
    "finite_number": "a finite number",
    "string_type": "a text",
    "bool_parsing": "true or false",
    "bool_type": "true or false",
    "dict_type": "an object",
    "model_type": "an object",
    "model_attributes_type": "an object",
    "tuple_type": "a list",
    "list_type": "a list",
    "greater_than": "above {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "below {lt}",
    "less_than_equal": "at most {le}",
    "too_short": "at least {min_length}",
    "too_long": "at most {max_length}",
    "string_too_short": "at least {min_length} characters",
    "string_too_long": "at most {max_length} characters",
}


def without_consequences(errors: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """The errors without those that only follow from others: a list is not too short because of what is wrong in it."""
    longer = {each["loc"][:depth] for each in errors for depth in range(len(each["loc"]))}
    return [each for each in errors if each["type"] != "too_short" or each["loc"] not in longer]


def explain(error: Mapping[str, Any], body: object, request: Request) -> SpecError:
    """One error of pydantic's, as a reader wants it.

    Args:
        error: an item of `ValidationError.errors()`, its place first in `loc`.
        body: that was sent.
        request: that it came with; its route knows what would have been right.
    """
    place, *path = error["loc"]
    path = path[: _depth(body, path)] if place == "body" else path
    if error["type"] == "extra_forbidden":
        return _unknown_field(str(place), path, error["input"], request)
    permitted, message = _permitted(error), str(error["msg"])
    if error["type"] == "model_attributes_type" and isinstance(error["input"], bytes):
        message = "The body must be sent as JSON, with the header `Content-Type: application/json`"
    absent = error["type"] == "missing" or isinstance(error["input"], bytes)
    return SpecError(
        pointer=_pointer(str(place), path),
        value=None if absent else finite(error["input"]),
        message=message,
        permitted=permitted,
        nearest=_nearest(error["input"], permitted),
    )


def finite(value: object, depth: int = 6) -> object:
    """The value as JSON can carry it: nan and infinities as text, texts in valid Unicode; what is too large is cut."""
    if isinstance(value, bool | int | None):
        return value if not isinstance(value, int) or abs(value) < 2**1024 else "a huge number"
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, str):
        text = value.encode("utf-8", "replace").decode()
        return text if len(text) <= 1000 else f"{text[:1000]}…"
    if isinstance(value, Mapping) and depth:
        return {str(finite(str(key))): finite(each, depth - 1) for key, each in islice(value.items(), MOST_ERRORS)}
    if isinstance(value, Sequence) and not isinstance(value, bytes) and depth:
        return [finite(each, depth - 1) for each in islice(value, MOST_ERRORS)]
    return "…"


def _depth(body: object, path: Sequence[str | int]) -> int:
    """How far the path leads in what was sent: where `"smoke"` is short for `{"preset": "smoke"}`, no further."""
    for depth, part in enumerate(path):
        if isinstance(body, dict):
            body = body.get(part)
        elif isinstance(body, list) and isinstance(part, int) and part < len(body):
            body = body[part]
        else:
            return depth
    return len(path)


def _pointer(place: str, path: Sequence[str | int]) -> str:
    """RFC 6901 into the body; the bare name of a query or path parameter."""
    if place != "body":
        return "/".join(str(part) for part in path)
    return "".join("/" + _text(part).replace("~", "~0").replace("/", "~1") for part in path)


def _text(part: object) -> str:
    return str(finite(str(part)))


def _permitted(error: Mapping[str, Any]) -> tuple[str, ...] | str | None:
    context = error.get("ctx", {})
    if error["type"] in {"literal_error", "enum"}:
        return tuple(re.findall(r"'([^']*)'", context["expected"]))
    template = PERMITTED.get(error["type"])
    return template.format(**context) if template else None


def _nearest(value: object, permitted: tuple[str, ...] | str | None) -> str | None:
    if not isinstance(value, str) or not isinstance(permitted, tuple):
        return None
    return next(iter(get_close_matches(value, permitted, n=1, cutoff=0.5)), None)


def _unknown_field(place: str, path: Sequence[str | int], value: object, request: Request) -> SpecError:
    name = _text(path[-1])
    fields = _fields(request, path[:-1]) if place == "body" else tuple(_parameters(request))
    nearest = _nearest(name, fields)
    hint = f" (did you mean {nearest!r}?)" if nearest else ""
    kind = "field" if place == "body" else "parameter"
    message = f"there is no {kind} called {name!r}{hint}; there is {', '.join(fields)}"
    return SpecError(
        pointer=_pointer(place, path), value=finite(value), message=message, permitted=fields, nearest=nearest
    )


def _fields(request: Request, path: Sequence[str | int]) -> tuple[str, ...]:
    """The fields that the model at this place of the body has."""
    annotation: Any = request.scope["route"].body_field.field_info.annotation
    for part in path:
        models = _models(annotation)
        if models and part in models[0].model_fields:
            annotation = models[0].model_fields[str(part)].annotation
    models = _models(annotation)
    return tuple(models[0].model_fields) if models else ()


def _models(annotation: object) -> list[type[BaseModel]]:
    """The model in `Model`, `Model | None` or `tuple[Model, ...]`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    if get_origin(annotation) in {Union, UnionType, tuple}:
        return [model for each in get_args(annotation) for model in _models(each)]
    return []


def given_twice(request: Request) -> list[Violation]:
    """The query parameters of which the endpoint takes one value, and the request has several."""
    given = {name: request.query_params.getlist(name) for name, several in _parameters(request).items() if not several}
    return [
        Violation(name, values, f"it is given {len(values)} times, and takes one value", "one value")
        for name, values in given.items()
        if len(values) > 1
    ]


def _parameters(request: Request) -> dict[str, bool]:
    """The query parameters that the endpoint takes, and whether each takes several values."""
    queries = (field.field_info.annotation for field in request.scope["route"].dependant.query_params)
    models = [model for each in queries for model in _models(each)]
    return {
        field.alias or name: get_origin(field.annotation) is list
        for model in models
        for name, field in model.model_fields.items()
    }
