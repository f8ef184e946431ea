"""The output of commands: a JSON document with `--json`, else text."""

import json
from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

import typer
from pydantic import BaseModel

Value: TypeAlias = "BaseModel | Mapping[str, Any] | Iterable[Any] | str | int | float | bool | None"


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
    typer.echo(json.dumps(plain(value), ensure_ascii=False, allow_nan=False, indent=None if line else 2))


def plain(value: Value) -> Any:  # noqa: ANN401 - JSON
    """Return the value with dictionaries, lists and plain values only."""
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if isinstance(value, Mapping):
        return {str(name): plain(item) for name, item in value.items()}
    if value is None or isinstance(value, str | int | float):
        return value
    return [plain(item) for item in value]
