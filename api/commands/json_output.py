"""What the command prints with `--json`: one document on standard output, for programs."""

import json
from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

import typer
from pydantic import BaseModel

Value: TypeAlias = "BaseModel | Mapping[str, Any] | Iterable[Any] | str | int | float | bool | None"


def document(value: Value, *, line: bool = False) -> None:
    """Print it as JSON, as the API would give it.

    Args:
        value: of schemas, mappings, lists and plain values.
        line: in one line, where documents follow each other.
    """
    typer.echo(json.dumps(plain(value), ensure_ascii=False, allow_nan=False, indent=None if line else 2))


def plain(value: Value) -> Any:  # noqa: ANN401 - JSON
    """The value as JSON has it."""
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if isinstance(value, Mapping):
        return {str(name): plain(each) for name, each in value.items()}
    if value is None or isinstance(value, str | int | float):
        return value
    return [plain(each) for each in value]
