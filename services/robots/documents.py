"""URDFs and MJCFs into which tuned values are written.

Both have masses, centres, inertias, limits, damping, friction and efforts; an MJCF also armatures, gains, time step and
gravity.
"""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gaplab.services.core.errors import InvalidRobot
from gaplab.services.robots.bodies import joint_name, joint_number, tensor
from gaplab.services.robots.comparing import Change, Inertial
from gaplab.services.robots.options import ImportOptions
from gaplab.services.robots.reading import Handle
from gaplab.services.robots.urdf import find_mesh
from gaplab.services.robots.xml import Document, Element, child, decoded, numbers, scaled, tree

_OF_JOINTS = {"damping": "damping", "dry_friction": "frictionloss", "armature": "armature"}
_FILES = {"mesh": "meshdir", "hfield": "meshdir", "texture": "texturedir", "skin": "meshdir"}


class MjcfDocument(Document):
    """An MJCF whose values change; files that it includes become part of it."""

    def __init__(self, text: str, folder: Path, model: Handle, options: ImportOptions) -> None:
        super().__init__(text)
        _include(self.root, folder)
        self._model, self._has_motors = model, options.motor is None
        elements = [each for world in self.root.findall("worldbody") for each in world.iter()]
        self._bodies = [each for each in elements if each.tag == "body"]
        joints = [each for body in self._bodies for each in body if each.tag in {"joint", "freejoint"}]
        self._joints = [each for each in joints if not options.locks(each.get("name", ""))]
        if len(self._joints) == model.njnt - 1:  # the import made the base free
            self._joints.insert(0, tree("<freejoint/>"))
        drives = [each for group in self.root.findall("actuator") for each in group if isinstance(each.tag, str)]
        self._actuators = [each for each in drives if not options.locks(each.get("joint", ""))]
        self._check()

    def write(self, change: Change) -> bool:
        """Write a value; return whether the format has a place for it."""
        kind, name, value = change.place
        if change.after is None:
            return False
        if kind == "world":
            return self._write_of_the_world(value, change.after)
        if kind != "joints":
            return False
        joint = self._joint(name)
        if value in _OF_JOINTS:
            joint.set(_OF_JOINTS[value], numbers(change.after))
            return True
        if value == "limits":
            is_angle = joint.get("type", "hinge") != "slide" and self._compiler("angle", "degree") == "degree"
            joint.set("range", numbers(*(np.degrees(change.after) if is_angle else change.after)))
            joint.set("limited", "true")
            return True
        return value.startswith("motor.") and self._write_motor(name, value, change.after)

    def write_body(self, found: Sequence[Inertial]) -> bool:
        """Write mass, centre and inertia of the members of a body; return whether the file lets them have their own."""
        if self._compiler("settotalmass", ""):
            return False
        if self._compiler("inertiafromgeom", "auto") == "true":
            self._state_all()
        for each in found:
            self._state(each.number, each.mass_kg, each)
        return True

    def move(self, before: Path, after: Path) -> None:
        """Change the names of files for an MJCF in another folder."""
        for element in self.root.iter():
            given = element.get("file", "")
            if element.tag in _FILES and given and not Path(given).is_absolute():
                folder = before / (self._compiler("assetdir", "") or self._compiler(_FILES[str(element.tag)], ""))
                element.set("file", Path(os.path.relpath(folder / given, after)).as_posix())
        for compiler in self.root.findall("compiler"):
            for name in ("meshdir", "texturedir", "assetdir"):
                compiler.attrib.pop(name, None)

    def _check(self) -> None:
        """Raise an error unless the elements are the bodies and joints of the model, in its order."""
        model = self._model
        names = [each.get("name", "") for each in self._bodies]
        if names != [str(model.body(at).name) for at in range(1, model.nbody)] or len(self._joints) != model.njnt:
            raise InvalidRobot(["the bodies of the MJCF are made by frames or copies: write robot.json instead"])

    def _joint(self, name: str) -> Element:
        return self._joints[joint_number(self._model, name)]

    def _compiler(self, name: str, default: str) -> str:
        return next((each.get(name, default) for each in self.root.findall("compiler") if each.get(name)), default)

    def _state_all(self) -> None:
        """State the inertias that MuJoCo computes of shapes, so that it can use stated ones."""
        for compiler in self.root.findall("compiler"):
            compiler.attrib.pop("inertiafromgeom", None)
        for at in range(1, self._model.nbody):
            if self._model.body_mass[at] > 0:
                self._state(at, float(self._model.body_mass[at]), None)

    def _state(self, number: int, mass_kg: float, found: Inertial | None) -> None:
        model, inertial = self._model, child(self._bodies[number - 1], "inertial")
        turn = model.body_iquat[number] if found is None else np.roll(found.axes.as_quat(), 1)
        inertial.attrib.clear()
        inertial.set("mass", numbers(mass_kg))
        inertial.set("pos", numbers(*(model.body_ipos[number] if found is None else found.center_m)))
        inertial.set("quat", numbers(*turn))
        moments = model.body_inertia[number] if found is None else found.moments_kg_m2
        inertial.set("diaginertia", numbers(*moments))

    def _write_of_the_world(self, value: str, number: Any) -> bool:  # noqa: ANN401 - any value of a world
        if value == "time_step_s":
            child(self.root, "option").set("timestep", numbers(number))
        elif value == "gravity_m_s2":
            child(self.root, "option").set("gravity", numbers(0, 0, -number))
        else:
            return False
        return True

    def write_friction(self, coefficient: float) -> None:
        """Write the coefficient of all contacts: MuJoCo's static and dynamic one are the same."""
        for geom in [each for world in self.root.findall("worldbody") for each in world.iter("geom")]:
            others = geom.get("friction", "1").split()[1:]
            geom.set("friction", " ".join([numbers(coefficient), *others]))

    def _write_motor(self, name: str, value: str, number: float) -> bool:
        if not self._has_motors:  # an option gives the joints other motors, with the torque that the joint bears
            if value == "motor.max_torque_nm":
                _limit(self._joint(name), "actuatorfrc", number)
            return value == "motor.max_torque_nm"
        model = self._model
        at = next(
            (a for a in range(model.nu) if joint_name(model, int(np.ravel(model.actuator_trnid[a])[0])) == name), -1
        )
        if at < 0 or self._actuators[at].tag not in {"motor", "position", "velocity"}:
            return False
        element, gear = self._actuators[at], float(model.actuator_gear[at, 0])
        if value == "motor.max_torque_nm":
            self._write_torque(at, name, number)
        elif value == "motor.kp" and element.tag == "position":
            element.set("kp", numbers(number / gear**2))
        elif value == "motor.kd" and element.tag in {"position", "velocity"}:
            element.set("kv", numbers(number / gear**2))
            element.attrib.pop("dampratio", None)
        else:
            return False
        return True

    def _write_torque(self, at: int, name: str, number: float) -> None:
        """Write every limit that the file has, since an import takes the smallest; write one of the force if none."""
        model, element, joint = self._model, self._actuators[at], self._joint(name)
        is_control = element.tag == "motor" and bool(model.actuator_ctrllimited[at])
        is_of_joint = bool(model.jnt_actfrclimited[self._joints.index(joint)])
        largest = number / abs(float(model.actuator_gear[at, 0]))
        if is_control:
            _limit(element, "ctrl", largest)
        if is_of_joint:
            _limit(joint, "actuatorfrc", number)
        if model.actuator_forcelimited[at] or not (is_control or is_of_joint):
            _limit(element, "force", largest)


def _limit(element: Element, what: str, largest: float) -> None:
    """Write a range to both sides, and that it counts."""
    element.set(f"{what}range", numbers(-largest, largest))
    element.set(f"{what}limited", "true")


def _include(root: Element, folder: Path) -> None:
    """Replace `<include>` by what the file has, as MuJoCo does."""
    for parent in list(root.iter()):
        for place, element in reversed(list(enumerate(parent))):
            if element.tag == "include":
                included = tree(decoded((folder / element.get("file", "")).read_bytes()))
                _include(included, folder)
                parent.remove(element)
                for each in reversed(list(included)):
                    parent.insert(place, each)


_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_OF_URDF_JOINTS = {
    "damping": ("dynamics", "damping"),
    "dry_friction": ("dynamics", "friction"),
    "motor.max_torque_nm": ("limit", "effort"),
}
"""Element and attribute of a joint's values."""


class UrdfDocument(Document):
    """A URDF whose values change."""

    def write(self, change: Change) -> bool:
        """Write a value of a joint; return whether the format has a place for it."""
        kind, name, value = change.place
        joint = next((each for each in self.root.findall("joint") if each.get("name") == name), None)
        if kind != "joints" or joint is None or change.after is None:
            return False
        if value == "limits":
            for end, number in zip(("lower", "upper"), change.after, strict=True):
                child(joint, "limit").set(end, numbers(number))
            return True
        if value not in _OF_URDF_JOINTS:
            return False
        tag, attribute = _OF_URDF_JOINTS[value]
        child(joint, tag).set(attribute, numbers(change.after))
        return True

    def write_body(self, found: Sequence[Inertial]) -> bool:
        """Write mass, centre and inertia of the links of a body; return whether all of them have an inertial."""
        links = {link.get("name"): link.find("inertial") for link in self.root.findall("link")}
        if any(links.get(each.body) is None for each in found):
            return False
        for each in found:
            inertial = links[each.body]
            assert inertial is not None
            _write(inertial, each)
        return True

    def move(self, before: Path, after: Path) -> None:
        """Change the names of meshes for a URDF in another folder, unless its packages are found from there too."""
        for mesh in self.root.iter("mesh"):
            given = mesh.get("filename", "")
            path = find_mesh(given, before)
            if path is not None and not Path(given).is_absolute() and find_mesh(given, after) != path:
                mesh.set("filename", Path(os.path.relpath(path, after)).as_posix())


def _write(inertial: Element, found: Inertial) -> None:
    inertia, origin = child(inertial, "inertia"), child(inertial, "origin")
    if np.any(found.moved_m):
        place = np.array([float(each) for each in origin.get("xyz", "0 0 0").split()]) + found.moved_m
        origin.set("xyz", numbers(*place))
    if np.isfinite(found.scale):
        scaled(child(inertial, "mass"), "value", found.scale)
        for name in _MOMENTS:
            scaled(inertia, name, found.scale)
        return
    child(inertial, "mass").set("value", numbers(found.mass_kg))
    origin.set("rpy", "0 0 0")
    for name, value in zip(_MOMENTS, tensor(found.moments_kg_m2, found.axes)[np.triu_indices(3)], strict=True):
        inertia.set(name, numbers(value))
