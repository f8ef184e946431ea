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

_AT_LEAST_0 = {
    ("mass", "value"),
    ("inertia", "ixx"),
    ("inertia", "iyy"),
    ("inertia", "izz"),
    ("limit", "effort"),
    ("limit", "velocity"),
    ("dynamics", "damping"),
    ("dynamics", "friction"),
}

_MOVING = {"revolute", "continuous", "prismatic"}

_ABOVE_0 = {
    ("box", "size"),
    ("sphere", "radius"),
    ("cylinder", "radius"),
    ("cylinder", "length"),
    ("capsule", "radius"),
    ("capsule", "length"),
}
"""Sizes of shapes that touch."""

_REQUIRED = _ABOVE_0 | {("mass", "value"), *(("inertia", name) for name in _NUMBERS["inertia"])}


def check_values(root: Element, notes: Notes) -> None:
    """Refuse what is missing, not a finite number or out of its range, and limits in the wrong order; name each line.

    A joint whose limits are equal is free in MuJoCo, which is noted.
    """
    for joint in root.findall("joint"):
        for limit in joint.findall("limit"):
            _check_limits(joint, limit, notes)
    for element in root.iter(*_NUMBERS):
        for name, count in _NUMBERS[element.tag].items():
            if reason := _wrong(element, name, element.get(name), count):
                notes.refuse(f"line {element.sourceline}: {_owner(element)}{element.tag} {reason}")


def _wrong(element: Element, name: str, given: str | None, count: int) -> str | None:
    """Return what is wrong with an attribute, beginning with its name; None if nothing."""
    what, is_used = (element.tag, name), _is_used(element)
    if given is None:
        return f"has no {name}" if what in _REQUIRED and is_used else None
    found = list(_parsed(given))
    reason = None
    if len(found) != count or not all(map(math.isfinite, found)):
        reason = f"not {count} finite numbers" if count > 1 else "not a finite number"
    elif what in _AT_LEAST_0 and found[0] < 0:
        reason = "below 0"
    elif what in _ABOVE_0 and is_used and min(found) <= 0:
        reason = f"not {count} numbers above 0" if count > 1 else "not above 0"
    elif what == ("axis", "xyz") and not any(found) and element.getparent().get("type") in _MOVING:
        reason = "not a direction; give one like '0 1 0'"
    return reason and f"{name} {given!r} is {reason}"


def _is_used(element: Element) -> bool:
    """Return whether an element is of a link's inertial or collision, and not of an extension or of what is seen."""
    around = {each.tag for each in element.iterancestors()}
    return "link" in around and not around.isdisjoint({"inertial", "collision"}) and "gazebo" not in around


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
