"""Consoles that print for a person: to a terminal, or to the file that the output is redirected to."""

import re
from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

_CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def printable(text: str) -> str:
    """Return a text with control characters escaped as in JSON, so that names of others cannot control a terminal."""
    return _CONTROLS.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


class _Screen(Console):
    """A console whose texts are as `printable` returns them; its own colours and movements stay."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield the parts of what is printed."""
        for part in super().render(renderable, options):
            yield part if part.control else part._replace(text=printable(part.text))


def console(*, stderr: bool = False) -> Console:
    """Return a console; without a terminal it is wide, so that the lines of a log are not cut at 80 characters."""
    terminal = _Screen(stderr=stderr, highlight=False)
    return terminal if terminal.is_terminal else _Screen(stderr=stderr, highlight=False, width=160)
