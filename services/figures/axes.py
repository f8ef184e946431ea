"""The axes of a panel."""

from dataclasses import dataclass

from gaplab.services.figures.checks import check_numbers


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
