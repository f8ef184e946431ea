"""The check of the numbers of marks."""

from collections.abc import Sequence
from math import isfinite

Number = float | None


def check_numbers(name: str, parts: Sequence[Sequence[Number]], optional: Sequence[Sequence[object]] = ()) -> None:
    """Refuse numbers that JSON does not have, and parts of different lengths; optional parts may be empty.

    Raises:
        ValueError: the message has the name and the value or the lengths.
    """
    lengths = {len(part) for part in (*parts, *filter(None, optional))}
    if len(lengths) > 1:
        raise ValueError(f"the parts of {name!r} have {sorted(lengths)} values; they must have equally many")
    for value in (each for part in (*parts, *optional) for each in part if isinstance(each, int | float)):
        if not isfinite(value):
            raise ValueError(f"{name!r} has the value {value}; a missing value must be None")
