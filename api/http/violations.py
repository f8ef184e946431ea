"""Explanations of invalid requests: the place, the value, what is permitted, and the nearest valid name."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from itertools import islice
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from fastapi import Request
from pydantic import BaseModel

from gaplab.schemas.mistakes import permitted_by, pointer_to, sentence, within
from gaplab.services.core.errors import Violation, unknown_name

MOST_ERRORS = 50
"""Most errors in one answer: a hostile body could cause thousands."""


def without_consequences(errors: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return the errors without consequences of others: pydantic calls a list too short if its items are invalid."""
    parents = {error["loc"][:depth] for error in errors for depth in range(len(error["loc"]))}
    return [error for error in errors if error["type"] != "too_short" or error["loc"] not in parents]


def explain(error: Mapping[str, Any], body: object, request: Request) -> Violation:
    """Return an error of pydantic in the words of the API.

    Args:
        error: an item of `ValidationError.errors()`; its `loc` begins with body, query, path or header.
        body: the body that was sent.
        request: its route has the valid fields and parameters.
    """
    place, *path = error["loc"]
    kinds = _models(request.scope["route"].body_field.field_info.annotation) if place == "body" else []
    if len(kinds) > 1 and path:  # the kind of the body comes first
        kinds = [each for each in kinds if each.__name__.lower().startswith(str(path[0]))]
        path = path[1:]
    path = within(body, path) if place == "body" else path
    if error["type"] == "extra_forbidden":
        fields = _fields(kinds, path[:-1]) if place == "body" else tuple(_parameters(request))
        kind, name = "field" if place == "body" else "parameter", _text(path[-1])
        return replace(unknown_name(_pointer(str(place), path), kind, name, fields), value=error["input"])
    permitted, message = permitted_by(error), str(finite(sentence(error, path)))
    if error["type"] == "model_attributes_type" and isinstance(error["input"], bytes):
        message = "send the body as JSON, with the header `Content-Type: application/json`"
    absent = error["type"] == "missing" or isinstance(error["input"], bytes)
    value, nearest = None if absent else error["input"], _nearest(error["input"], permitted)
    return Violation(_pointer(str(place), path), value, message, permitted, nearest)


def finite(value: object, depth: int = 6) -> object:
    """Return the value as valid JSON: nan and infinities as text, invalid Unicode replaced, large values cut."""
    if isinstance(value, bool | int | None):
        return value if not isinstance(value, int) or abs(value) < 2**1024 else "a huge number"
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, str):
        text = value.encode("utf-8", "replace").decode()
        return text if len(text) <= 1000 else f"{text[:1000]}…"
    if isinstance(value, Mapping) and depth:
        return {_text(key): finite(item, depth - 1) for key, item in islice(value.items(), MOST_ERRORS)}
    if isinstance(value, Sequence) and not isinstance(value, bytes) and depth:
        return [finite(item, depth - 1) for item in islice(value, MOST_ERRORS)]
    return "…"


def _pointer(place: str, path: Sequence[str | int]) -> str:
    """Return a JSON pointer (RFC 6901) into the body, or the name of a query or path parameter."""
    if place != "body":
        return "/".join(str(part) for part in path)
    return pointer_to(_text(part) for part in path)


def _text(part: object) -> str:
    return str(finite(str(part)))


def _nearest(value: object, permitted: tuple[str, ...] | str | None) -> str | None:
    if not isinstance(value, str) or not isinstance(permitted, tuple):
        return None
    return next(iter(get_close_matches(value, permitted, n=1, cutoff=0.5)), None)


def _fields(models: Sequence[type[BaseModel]], path: Sequence[str | int]) -> tuple[str, ...]:
    """Return the names of the fields at a place in one of these models."""
    for part in path:
        if models and part in models[0].model_fields:
            models = _models(models[0].model_fields[str(part)].annotation)
    return tuple(models[0].model_fields) if models else ()


def _models(annotation: object) -> list[type[BaseModel]]:
    """Return the models in an annotation like `Model`, `Model | None`, `tuple[Model, ...]` or `Annotated[Model, …]`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    if get_origin(annotation) is Annotated:
        return _models(get_args(annotation)[0])
    if get_origin(annotation) in {Union, UnionType, tuple}:
        return [model for part in get_args(annotation) for model in _models(part)]
    return []


def wrong_parameters(request: Request) -> list[Violation]:
    """Return a violation for each query parameter that is repeated, or given to an operation that has none.

    An operation that has parameters refuses unknown ones by their model.
    """
    known, given = _parameters(request), {name: request.query_params.getlist(name) for name in request.query_params}
    repeated = [
        Violation(name, values, f"it is given {len(values)} times; give it once", "one value")
        for name, values in given.items()
        if len(values) > 1 and known.get(name) is False
    ]
    return repeated or [
        Violation(_text(name), values, f"unknown parameter {_text(name)!r}; this operation has none", "no parameter")
        for name, values in list(given.items())[:MOST_ERRORS]
        if not known
    ]


def _parameters(request: Request) -> dict[str, bool]:
    """Return the query parameters of the endpoint, and whether each takes several values."""
    queries = (field.field_info.annotation for field in request.scope["route"].dependant.query_params)
    models = [model for annotation in queries for model in _models(annotation)]
    return {
        field.alias or name: get_origin(field.annotation) is list
        for model in models
        for name, field in model.model_fields.items()
    }
