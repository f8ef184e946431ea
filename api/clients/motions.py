"""Motions as drivers get them."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field

from gaplab.api.clients.connection import Connection, segment


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


def motion_of(connection: Connection, request: str) -> DriverMotion:
    """Return the motion that a request asks for; see `TakenRequest.motion`."""
    found = json.loads(connection.get_bytes(f"/requests/{segment(request)}/motion", format="json"))
    return DriverMotion(
        actuators=tuple(found["actuators"]),
        units=tuple(found["units"]),
        times_s=tuple(found["times_s"]),
        targets=tuple(map(tuple, found["targets"])),
        observe_s=tuple(found["observe_s"]),
        start=found["start"],
    )
