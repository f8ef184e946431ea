"""Motions as drivers get them."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class DriverMotion:
    """Targets of actuators over time, constant between changes.

    Attributes:
        actuators: their names.
        units: unit of the targets of each: rad, rad/s or N·m for a hinge, m, m/s or N for a slide.
        times_s: times at which targets change.
        targets: a row of targets for each time, with a column for each actuator.
        observe_s: times of observation; the last one ends the run.
        start: angle of each joint before the motion, rad or m.
    """

    actuators: tuple[str, ...]
    units: tuple[str, ...]
    times_s: tuple[float, ...]
    targets: tuple[tuple[float, ...], ...]
    observe_s: tuple[float, ...]
    start: Mapping[str, float] = field(default_factory=dict)
