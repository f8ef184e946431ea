"""Checks of the links and joints of a URDF: their names, and what joins what."""

from collections.abc import Mapping, Sequence

from gaplab.services.robots.notes import Notes, listed
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
