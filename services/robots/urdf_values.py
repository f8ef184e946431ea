"""Checks of the numbers in a URDF, which other readers take silently for others."""

import math
from collections.abc import Iterator

from gaplab.services.robots.notes import Notes
from gaplab.services.robots.xml import Element

_NUMBERS = {
    "mass": {"value": 1},
    "inertia": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 1),
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "mesh": {"scale": 3},
    "limit": {"lower": 1, "upper": 1, "effort": 1, "velocity": 1},
    "dynamics": {"damping": 1, "friction": 1},
}
"""How many numbers an attribute has, by its element."""

_AT_LEAST_0 = {("limit", "effort"), ("limit", "velocity"), ("dynamics", "damping"), ("dynamics", "friction")}


def check_values(root: Element, notes: Notes) -> None:
    """Refuse what is no finite number, negative efforts and frictions, and limits in the wrong order; name each line.

    A joint whose limits are equal is free in MuJoCo, which is noted.
    """
    for joint in root.findall("joint"):
        for limit in joint.findall("limit"):
            _check_limits(joint, limit, notes)
    for element in root.iter(*_NUMBERS):
        for name, count in _NUMBERS[element.tag].items():
            given = element.get(name)
            if given is not None and (reason := _wrong(element, name, given, count)):
                notes.refuse(f"line {element.sourceline}: {_owner(element)}{element.tag} {name} {given!r} is {reason}")


def _wrong(element: Element, name: str, given: str, count: int) -> str | None:
    found = list(_parsed(given))
    if len(found) != count or not all(map(math.isfinite, found)):
        return f"not {count} finite numbers" if count > 1 else "no finite number"
    return "below 0" if (element.tag, name) in _AT_LEAST_0 and found[0] < 0 else None


def _parsed(given: str) -> Iterator[float]:
    for word in given.split():
        try:
            yield float(word)
        except ValueError:
            yield math.nan


def _check_limits(joint: Element, limit: Element, notes: Notes) -> None:
    if joint.get("type") not in {"revolute", "prismatic"}:
        return
    lower, upper = (next(_parsed(limit.get(name, "0")), math.nan) for name in ("lower", "upper"))
    if lower > upper:
        given = f"joint {joint.get('name', '')} has limits {lower:g} to {upper:g}"
        notes.refuse(f"line {limit.sourceline}: {given}; the smaller is first")
    elif lower == upper:
        notes.lose("joints whose limits are equal have none: {}", joint.get("name", ""))


def _owner(element: Element) -> str:
    """Return the link or joint that an element is part of, for sentences."""
    owner = next((each for each in element.iterancestors("link", "joint")), None)
    return "" if owner is None else f"{owner.tag} {owner.get('name', '')}: "
