"""The output of commands: a JSON document with `--json`, else text."""

import json
from typing import Any

import typer
from pydantic import TypeAdapter
from rich.console import RenderableType

from gaplab.api.clients.screen import console, printable


def echo(text: str, *, err: bool = False, nl: bool = True) -> None:
    """Print a text with its control characters escaped."""
    typer.echo(printable(text), err=err, nl=nl)


def print_result(value: object, *shown: RenderableType, as_json: bool) -> None:
    """Print the value as JSON, or for people the lines and tables that show it."""
    if as_json:
        print_json(value)
        return
    for each in shown:
        if isinstance(each, str):
            echo(each)
        else:
            console().print(each)


def print_json(value: object, *, line: bool = False) -> None:
    """Print a value in the JSON of the API, perhaps on one line, for several documents in one output."""
    plain = TypeAdapter(Any).dump_python(value, mode="json")
    echo(json.dumps(plain, ensure_ascii=False, allow_nan=False, indent=None if line else 2))
