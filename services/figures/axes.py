"""The axes of a panel, and the check of its numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Axis:
    """One axis of a panel.

    Attributes:
        label: name with the unit; empty for none.
        limits: the ends of the axis, ascending.
        whole: put ticks at whole numbers only.
        log: logarithmic; the limits are above 0.
        ticks: values and the texts that replace their numbers.
    """

    label: str
    limits: tuple[float, float]
    whole: bool = False
    log: bool = False
    ticks: tuple[tuple[float, str], ...] = ()

    def __post_init__(self) -> None:
        check_numbers(self.label, (self.limits,))
        if not self.limits[0] < self.limits[1] or (self.log and self.limits[0] <= 0):
            raise ValueError(f"the limits of an axis must ascend, from above 0 if it is logarithmic, not {self.limits}")
