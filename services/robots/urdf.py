"""URDF as MuJoCo can read it: with the paths of its meshes, and with notes of what MuJoCo drops or takes otherwise.

Names, what joins what, and numbers are checked before, as other readers take wrong ones silently for others.

Source: https://wiki.ros.org/urdf/XML, https://mujoco.readthedocs.io/en/stable/modeling.html#urdf-extensions
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from lxml import etree

from gaplab.services.robots.options import ImportOptions, Notes, listed
from gaplab.services.robots.xml import Element, child, decoded, tree

_LOST = {
    "transmission": "transmissions are lost, a motor moves its joint directly; of {}",
    "safety_controller": "soft limits of safety controllers are lost: {}",
    "contact": "contact properties are lost, friction too; of {}",
    "gazebo": "extensions for Gazebo are lost",
}
"""What is said of elements that MuJoCo drops, by tag."""

MOST_FACES = 200_000
"""Largest number of faces of an STL that MuJoCo reads."""


@dataclass(frozen=True)
class Urdf:
    """A URDF that MuJoCo can read.

    Attributes:
        text: URDF with absolute paths of meshes.
        assets: meshes that were converted, by name.
        masses_kg: masses of the links that have one.
        massless: links without <inertial>, which have no mass.
        speeds: largest speed of each joint that has one, rad/s or m/s.
        fixed: whether the file says that the base never moves.
    """

    text: str
    assets: dict[str, bytes]
    masses_kg: dict[str, float]
    massless: list[str]
    speeds: dict[str, float]
    name: str
    fixed: bool


def read_urdf(file: Path, text: str, options: ImportOptions, notes: Notes) -> Urdf:
    """Return a URDF that MuJoCo can read, and note what MuJoCo ignores.

    Raises:
        InvalidRobot: a name, a link or a number is wrong, or a mesh is missing; with every reason.
    """
    root = tree(text)
    _refuse_xacro(root, notes)
    notes.check()
    _check_structure(root, notes)
    _check_values(root, notes)
    notes.check()
    _lock(root, options, notes)
    is_held = _without_the_scene(root, notes)
    _complete_limits(root, notes)
    _refuse(root, notes)
    _note_losses(root, notes)
    if not options.visuals:
        for visual in list(root.iterfind("link/visual")):
            lines = etree.Comment("\n" * etree.tostring(visual, with_tail=False).count(b"\n"))
            lines.tail = visual.tail  # so that MuJoCo's errors name the lines of the file
            visual.getparent().replace(visual, lines)
    assets = dict(_resolve_meshes(root, file, notes))
    notes.check()
    compiler = child(child(root, "mujoco"), "compiler")
    compiler.set("discardvisual", "false" if options.visuals else "true")
    compiler.set("strippath", "false")
    masses = {_name(link): _mass_kg(link) for link in root.iter("link")}
    return Urdf(
        text="\n" * (root.sourceline - 1) + etree.tostring(root, encoding="unicode"),
        assets=assets,
        masses_kg={name: mass for name, mass in masses.items() if mass is not None},
        massless=[_name(link) for link in root.iter("link") if _mass_kg(link) is None],
        speeds=dict(_speeds(root)),
        name=_name(root),
        fixed=is_held,
    )


def _lock(root: Element, options: ImportOptions, notes: Notes) -> None:
    """Fix joints at zero."""
    notes.refuse_unknown(options.lock, [_name(joint) for joint in root.findall("joint")])
    for joint in root.findall("joint"):
        if options.locks(_name(joint)):
            joint.set("type", "fixed")
            for mimic in joint.findall("mimic"):
                joint.remove(mimic)


def _refuse(root: Element, notes: Notes) -> None:
    for joint in root.findall("joint"):
        if joint.find("mimic") is not None:
            notes.refuse(f"joint {_name(joint)} mimics another, but gaplab cannot couple joints; --lock fixes it")
        if joint.get("type") in {"planar", "floating"}:
            notes.refuse(f"joint {_name(joint)} is {joint.get('type')}, but must be a hinge or slide; --lock fixes it")


def _note_losses(root: Element, notes: Notes) -> None:
    for tag, line in _LOST.items():
        owners = [_name(found) or _name(owner) for owner in root.iter() for found in owner.findall(tag)]
        if owners:
            notes.lose(line, *owners)
    if foreign := list(dict.fromkeys(str(each.tag) for each in root.iter() if ":" in str(each.tag))):
        notes.lose("elements of extensions are lost: {}", *foreign)
    shaped = [link for link in root.findall("link") if link.find("collision") is not None]
    if weightless := [_name(link) for link in shaped if link.find("inertial") is None]:
        notes.lose("without <inertial>, so without a mass of their own: {}", *weightless)


def _speeds(root: Element) -> Iterator[tuple[str, float]]:
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        if limit is not None and joint.get("type") != "fixed" and float(limit.get("velocity", 0)) > 0:
            yield _name(joint), float(limit.get("velocity", 0))


def _resolve_meshes(root: Element, file: Path, notes: Notes) -> Iterator[tuple[str, bytes]]:
    """Replace the names of mesh files by absolute paths; return those that had to be converted."""
    converted: dict[Path, str] = {}
    for mesh in root.iter("mesh"):
        given = mesh.get("filename", "")
        path = find_mesh(given, file.absolute().parent)
        if path is None:
            notes.refuse(f"mesh {given!r} was not found beside {file.name} or in a folder above it")
            continue
        package = given.rpartition("://")[2].partition("/")[0] if given.startswith("package:") else ""
        if package and package not in path.parts and package != _package(path):
            notes.lose(f"no folder is called {package}: its meshes are those of {path.parent}")
        if path.suffix.lower() == ".dae":
            is_new = path not in converted
            name = converted.setdefault(path, f"{len(converted)}_{path.stem}.stl")  # stems may be the same
            mesh.set("filename", name)
            if is_new:
                yield name, _converted(path, notes)
        else:
            mesh.set("filename", str(path))


def find_mesh(given: str, folder: Path) -> Path | None:
    """Return the file of a mesh that a URDF of this folder names, like `package://a1_description/meshes/trunk.stl`.

    It is beside the URDF, or as ROS finds a package, in a folder above it; None if there is none.
    """
    scheme, _, rest = given.rpartition("://")
    if scheme == "file":
        return Path(rest) if Path(rest).is_file() else None
    if not scheme:
        return folder / given if given and (folder / given).is_file() else None
    folders, (package, _, inside) = [folder, *folder.parents], rest.partition("/")
    named = [here / rest for here in folders]
    owned = [here / inside for owner in (package, None) for here in folders if _package(here / inside) == owner]
    return next((each for each in (*named, *owned) if inside and each.is_file()), None)


def _package(file: Path) -> str | None:
    """Return the name of the ROS package of a file, as the nearest `package.xml` above it says; None without one."""
    found = next((each / "package.xml" for each in file.parents if (each / "package.xml").is_file()), None)
    return None if found is None else str(tree(decoded(found.read_bytes())).findtext("name", "")).strip()


def _converted(path: Path, notes: Notes) -> bytes:
    """Return a DAE, in the unit that it says, as STL in metres."""
    if find_spec("trimesh") is None or find_spec("collada") is None:
        notes.refuse(f"{path.name} is a DAE, which trimesh reads: pip install 'gaplab[collada]'")
        return b""
    try:
        scene: Any = import_module("trimesh").load_scene(path)
        mesh = scene.convert_units("meters").to_mesh()
    except Exception as error:  # noqa: BLE001 - trimesh and collada raise anything for a broken file
        notes.refuse(f"{path} is not a DAE that can be read: {' '.join(str(error).split()) or type(error).__name__}")
        return b""
    if not 1 <= len(mesh.faces) <= MOST_FACES:
        notes.refuse(f"{path} has {len(mesh.faces)} faces, but 1 to {MOST_FACES} are permitted")
        return b""
    return bytes(mesh.export(file_type="stl"))


def _mass_kg(link: Element) -> float | None:
    mass = link.find("inertial/mass")
    return None if mass is None else float(mass.get("value", "nan"))


def _name(element: Element) -> str:
    return str(element.get("name", ""))


_SCENE = "world"
"""Name of the link to which a file fixes a robot that never moves, as Gazebo has it."""


def _refuse_xacro(root: Element, notes: Notes) -> None:
    """Refuse a file whose macros were not expanded: MuJoCo drops what is inside of them."""
    tags = [element for element in root.iter() if "xacro" in str(element.tag)]
    values = [each for each in root.iter() for value in each.attrib.values() if "${" in value or "$(" in value]
    for element in (tags or values)[:1]:
        notes.refuse(
            f"line {element.sourceline}: the file is xacro, of which a URDF is made: xacro FILE.xacro > FILE.urdf"
        )


def _complete_limits(root: Element, notes: Notes) -> None:
    """Let a joint with one limit have 0 as the other one."""
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        if limit is None or joint.get("type") not in {"revolute", "prismatic"}:
            continue
        missing = [name for name in ("lower", "upper") if limit.get(name) is None]
        if len(missing) == 1:
            limit.set(missing[0], "0")
            notes.lose(f"without a limit called {missing[0]}, which is then 0: {{}}", joint.get("name", ""))


def _without_the_scene(root: Element, notes: Notes) -> bool:
    """Remove an empty root link from which the base floats, and return whether the file fixes the base to the world."""
    carried = {child.get("link") for child in root.iterfind("joint/child")}
    roots = [link for link in root.findall("link") if link.get("name") not in carried]
    if len(roots) != 1 or any(roots[0].find(tag) is not None for tag in ("inertial", "collision", "visual")):
        return False
    (scene,), name = roots, roots[0].get("name", "")
    held = [joint for joint in root.findall("joint") if joint.find("parent").get("link") == name]
    kinds = [joint.get("type") for joint in held]
    if kinds == ["floating"]:
        root.remove(held[0])
        root.remove(scene)
    if kinds != ["fixed"] or name != _SCENE:
        return False
    notes.lose(f"the base never moves, as joint {held[0].get('name', '')} fixes it to the link {name}")
    return True


_TYPES = ("revolute", "continuous", "prismatic", "fixed")
"""Types of joints that a World has; the last one does not move."""

_OTHER_TYPES = ("floating", "planar", "spherical")
"""Types of joints that are refused by their names, unless they are locked."""


def _check_structure(root: Element, notes: Notes) -> None:
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


_ANY, _AT_LEAST_0, _ABOVE_0 = "any", "at least 0", "above 0"

_NUMBERS = {
    "mass": {"value": (1, _AT_LEAST_0)},
    "inertia": {
        name: (1, _AT_LEAST_0 if name in {"ixx", "iyy", "izz"} else _ANY)
        for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    },
    "origin": dict.fromkeys(("xyz", "rpy"), (3, _ANY)),
    "axis": {"xyz": (3, _ANY)},
    "box": {"size": (3, _ABOVE_0)},
    "sphere": {"radius": (1, _ABOVE_0)},
    "cylinder": dict.fromkeys(("radius", "length"), (1, _ABOVE_0)),
    "capsule": dict.fromkeys(("radius", "length"), (1, _ABOVE_0)),
    "mesh": {"scale": (3, _ANY)},
    "limit": dict.fromkeys(("lower", "upper"), (1, _ANY)) | dict.fromkeys(("effort", "velocity"), (1, _AT_LEAST_0)),
    "dynamics": dict.fromkeys(("damping", "friction"), (1, _AT_LEAST_0)),
}
"""How many numbers an attribute has, and which are permitted, by its element; above 0 are sizes of what touches."""


def _check_values(root: Element, notes: Notes) -> None:
    """Refuse what is missing, not a finite number or out of its range, and limits in the wrong order; name each line.

    A joint whose limits are equal is free in MuJoCo, which is noted.
    """
    for joint in root.findall("joint"):
        for limit in joint.findall("limit"):
            _check_limits(joint, limit, notes)
    for element in root.iter(*_NUMBERS):
        for name, (count, permitted) in _NUMBERS[element.tag].items():
            if reason := _wrong(element, name, count, permitted):
                notes.refuse(f"line {element.sourceline}: {_owner(element)}{element.tag} {reason}")


def _wrong(element: Element, name: str, count: int, permitted: str) -> str | None:
    """Return what is wrong with an attribute, beginning with its name; None if nothing."""
    given, is_used = element.get(name), _is_used(element)
    if given is None:
        is_required = permitted == _ABOVE_0 or element.tag in {"mass", "inertia"}
        return f"has no {name}" if is_required and is_used else None
    found = list(_parsed(given))
    reason = None
    if len(found) != count or not all(map(math.isfinite, found)):
        reason = f"not {count} finite numbers" if count > 1 else "not a finite number"
    elif permitted == _AT_LEAST_0 and found[0] < 0:
        reason = "below 0"
    elif permitted == _ABOVE_0 and is_used and min(found) <= 0:
        reason = f"not {count} numbers above 0" if count > 1 else "not above 0"
    elif element.tag == "axis" and not any(found) and element.getparent().get("type") in _TYPES[:3]:
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
