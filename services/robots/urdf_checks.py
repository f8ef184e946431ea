"""Checks of a URDF: names, what joins what, and numbers that other readers take silently for others."""

import math
from collections.abc import Iterator, Mapping, Sequence

from gaplab.services.robots.options import Notes, listed
from gaplab.services.robots.xml import Element

_TYPES = ("revolute", "continuous", "prismatic", "fixed")
"""Types of joints that a World has."""

_OTHER_TYPES = ("floating", "planar", "spherical")
"""Types of joints that are refused by their names, unless they are locked."""


def check_structure(root: Element, notes: Notes) -> None:
    """Refuse links and joints without a name or with that of another, and joints that join no two links of the file."""
    links, joints = root.findall("link"), root.findall("joint")
    for elements in (links, joints):
        _check_names(elements, notes)
    for inertial in root.iterfind("link/inertial"):
        for tag in ("mass", "inertia"):
            if inertial.find(tag) is None:
                notes.refuse(f"line {inertial.sourceline}: link {inertial.getparent().get('name', '')}: no <{tag}>")
    names, carried = list(dict.fromkeys(filter(None, (link.get("name") for link in links)))), dict[str, Element]()
    for joint in joints:
        kind = joint.get("type")
        if kind not in _TYPES + _OTHER_TYPES:
            given = "no type" if kind is None else f"the type {kind!r}"
            notes.refuse(f"{_place(joint)} has {given}; permitted: {', '.join(_TYPES)}")
        ends = {role: _end(joint, role, names, notes) for role in ("parent", "child")}
        _check_child(joint, ends, carried, notes)


def _check_names(elements: Sequence[Element], notes: Notes) -> None:
    first = dict[str, Element]()
    for element in elements:
        name = element.get("name")
        if not name:
            notes.refuse(f"line {element.sourceline}: a {element.tag} has no name")
        elif name in first:
            notes.refuse(f"{_place(element)} has the name of that in line {first[name].sourceline}; rename one of them")
        else:
            first[name] = element


def _end(joint: Element, role: str, links: Sequence[str], notes: Notes) -> str | None:
    """Return the link at one end of a joint; None if the file has none."""
    end = joint.find(role)
    given = None if end is None else end.get("link")
    if given in links:
        return str(given)
    line = (joint if end is None else end).sourceline
    wrong = f"no {role} link is given" if given is None else f"{role} link {given!r} is not in the file"
    notes.refuse(f"line {line}: joint {joint.get('name', '')}: {wrong}; links: {listed(links, 30)}")
    return None


def _check_child(joint: Element, ends: Mapping[str, str | None], carried: dict[str, Element], notes: Notes) -> None:
    """Refuse a link that is its own parent, or the child of two joints; add it to those that a joint carries."""
    child = ends["child"]
    if child is None:
        return
    if child == ends["parent"]:
        notes.refuse(f"{_place(joint)} joins the link {child} to itself")
    elif child in carried:
        where = f"joint {carried[child].get('name', '')} in line {carried[child].sourceline}"
        notes.refuse(f"{_place(joint)}: child link {child!r} is already that of {where}; a link has one parent")
    else:
        carried[child] = joint


def _place(element: Element) -> str:
    return f"line {element.sourceline}: {element.tag} {element.get('name', '')}"


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
