"""The output of commands: a JSON document with `--json`, else text."""

import json
from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

import typer
from pydantic import BaseModel, TypeAdapter

Value: TypeAlias = "BaseModel | Mapping[str, Any] | Iterable[Any] | str | int | float | bool | None"

_PLAIN: TypeAdapter[object] = TypeAdapter(Any)


def print_result(value: Value, text: str, *, as_json: bool) -> None:
    """Print the value as JSON, or the text for people."""
    if as_json:
        print_json(value)
    else:
        typer.echo(text)


def print_json(value: Value, *, line: bool = False) -> None:
    """Print a value in the JSON of the API.

    Args:
        value: schemas, mappings, lists and plain values.
        line: on one line, for several documents in one output.
    """
    plain = _PLAIN.dump_python(value, mode="json")
    typer.echo(json.dumps(plain, ensure_ascii=False, allow_nan=False, indent=None if line else 2))
