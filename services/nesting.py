"""How deep JSON may nest: whatever walks through a value afterwards has stack for it."""

from typing import Any

from gaplab.schemas.mistakes import pointer_to
from gaplab.services.core.errors import InvalidSpec, Violation

MOST_LEVELS = 32
"""Most objects and lists inside each other. A spec has eight."""


def refuse_too_deep(value: object) -> None:
    """Refuse JSON that nests deeper than `MOST_LEVELS`.

    Raises:
        InvalidSpec: the pointer is that of the first value beyond.
    """
    level: list[tuple[tuple[object, ...], Any]] = [((), [value])]
    for _ in range(MOST_LEVELS + 1):
        level = [
            ((*place, key), inner)
            for place, outer in level
            for key, inner in (outer.items() if isinstance(outer, dict) else enumerate(outer))
            if isinstance(inner, dict | list)
        ]
    for (_, *place), _ in level[:1]:
        message = f"objects and lists may be nested {MOST_LEVELS} levels deep, but these are deeper"
        raise InvalidSpec([Violation(pointer_to(place), None, message, f"at most {MOST_LEVELS} levels")])
