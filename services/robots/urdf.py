"""URDF as MuJoCo can read it: with the paths of its meshes, and with notes of what MuJoCo drops or takes otherwise.

Source: https://wiki.ros.org/urdf/XML, https://mujoco.readthedocs.io/en/stable/modeling.html#urdf-extensions
"""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from lxml import etree

from gaplab.services.robots.options import ImportOptions, Notes
from gaplab.services.robots.urdf_checks import check_structure, check_values
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
        name: name of the robot in the file.
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
    refuse_xacro(root, notes)
    notes.check()
    check_structure(root, notes)
    check_values(root, notes)
    notes.check()
    _lock(root, options, notes)
    is_held = without_the_scene(root, notes)
    complete_limits(root, notes)
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
    """Return the file of a mesh: beside the URDF, or as ROS finds a package, in a folder above it; None if none is.

    Args:
        given: the name in the URDF, like `package://a1_description/meshes/trunk.stl`.
        folder: folder of the URDF.
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


def refuse_xacro(root: Element, notes: Notes) -> None:
    """Refuse a file whose macros were not expanded: MuJoCo drops what is inside of them."""
    tags = [element for element in root.iter() if "xacro" in str(element.tag)]
    values = [each for each in root.iter() for value in each.attrib.values() if "${" in value or "$(" in value]
    for element in (tags or values)[:1]:
        notes.refuse(
            f"line {element.sourceline}: the file is xacro, of which a URDF is made: xacro FILE.xacro > FILE.urdf"
        )


def complete_limits(root: Element, notes: Notes) -> None:
    """Let a joint with one limit have 0 as the other one."""
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        if limit is None or joint.get("type") not in {"revolute", "prismatic"}:
            continue
        missing = [name for name in ("lower", "upper") if limit.get(name) is None]
        if len(missing) == 1:
            limit.set(missing[0], "0")
            notes.lose(f"without a limit called {missing[0]}, which is then 0: {{}}", joint.get("name", ""))


def without_the_scene(root: Element, notes: Notes) -> bool:
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
