"""Differences between two steps of a log, to the last bit."""

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from math import isnan

import numpy as np

from gaplab.services.core.types import Step


def difference(stored: Step, computed: Step) -> str | None:
    """Return the first number that differs, with both values; None if all numbers have the same bits.

    The fit of simulators is compared if the archive knows it: those of earlier versions do not.
    """
    if type(stored) is not type(computed):
        return f"it is {type(computed).__name__} here, and {type(stored).__name__} in the archive"
    before = dict(_numbers(stored))
    now = {place: number for place, number in _numbers(computed) if place in before or ".fit." not in place}
    for place in before | now:
        if place not in before or place not in now or not _same_bits(before[place], now[place]):
            return f"{place} is {_shown(now, place)} here, and {_shown(before, place)} in the archive"
    return None


def _shown(numbers: Mapping[str, float], place: str) -> str:
    return repr(numbers[place]) if place in numbers else "absent"


def _numbers(value: object, place: str = "") -> Iterator[tuple[str, float]]:
    """Yield every number in a step with its place, like `simulators[0].squared_error`."""
    if is_dataclass(value):
        for field in fields(value):
            yield from _numbers(getattr(value, field.name), f"{place}.{field.name}" if place else field.name)
    elif isinstance(value, tuple | np.ndarray):
        for index, item in enumerate(value):
            yield from _numbers(item, f"{place}[{index}]")
    elif value is not None:
        yield place, float(value)  # type: ignore[arg-type] # steps have numbers only


def _same_bits(one: float, other: float) -> bool:
    return np.float64(one).tobytes() == np.float64(other).tobytes() or (isnan(one) and isnan(other))
