"""Commands whose arguments are measured values, which may be negative."""

import re
from typing import Any

from typer.core import TyperCommand

_NEGATIVE = re.compile(r"-\.?\d")


class ValuesCommand(TyperCommand):
    """A command that takes -0.3 as a number; other commands take it as the option -0."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - in a private module of Typer
        """Parse arguments; a space before a negative number says that it is no option, and means nothing to `float`."""
        return super().parse_args(ctx, [f" {each}" if _NEGATIVE.match(each) else each for each in args])
