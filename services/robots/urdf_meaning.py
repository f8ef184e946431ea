"""What a URDF means where MuJoCo takes it for something else.

Source: https://wiki.ros.org/urdf/XML/joint
"""

from gaplab.services.robots.notes import Notes
from gaplab.services.robots.xml import Element

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
