"""Commands whose arguments are measured values, which may be negative."""

import re
from collections.abc import Iterable
from math import isfinite, nan
from typing import Any

import typer
from typer.core import TyperCommand

_NEGATIVE = re.compile(r"-\.?\d")


class ValuesCommand(TyperCommand):
    """A command that takes -0.3 as a number; other commands take it as the option -0."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - in a private module of Typer
        """Parse arguments; a space before a negative number says that it is not an option. `float` ignores it."""
        return super().parse_args(ctx, [f" {each}" if _NEGATIVE.match(each) else each for each in args])


def numbers(values: Iterable[str] | None) -> list[float] | None:
    """Return measured values as numbers; None if there are none.

    Raises:
        typer.BadParameter: a value is not a finite number; its place is counted from 1.
    """
    return [_number(place, text.strip()) for place, text in enumerate(values or (), start=1)] or None


def _number(place: int, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = nan
    if not isfinite(number):
        raise typer.BadParameter(f"value {place}: {text!r} is not a finite number, like 0.41", param_hint="VALUE")
    return number
