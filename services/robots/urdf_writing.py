"""Tuned values in a URDF: masses, centres, inertias, limits, damping, friction and efforts."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gaplab.services.robots.changes import Change
from gaplab.services.robots.inertials import Inertial
from gaplab.services.robots.urdf import find_mesh
from gaplab.services.robots.xml import Document, Element, child, numbers, scaled

_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_OF_JOINTS = {
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
        if value not in _OF_JOINTS:
            return False
        tag, attribute = _OF_JOINTS[value]
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
    for name, value in zip(_MOMENTS, found.tensor[np.triu_indices(3)], strict=True):
        inertia.set(name, numbers(value))
