"""Robots of pybullet_data and gymnasium, used where they are: their files, and how each is imported."""

from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaplab.services.robots.importing import ImportedFile, import_robot
from gaplab.services.robots.options import ImportOptions

FILES: dict[str, tuple[str, dict[str, Any]]] = {
    "a1": ("a1/a1.urdf", {}),
    "laikago": ("laikago/laikago_toes_limits.urdf", {"mend": True}),
    "minitaur": ("quadruped/minitaur.urdf", {}),
    "aliengo": ("aliengo/aliengo.urdf", {}),
    "mini_cheetah": ("mini_cheetah/mini_cheetah.urdf", {"mend": True}),
    "vision60": ("quadruped/vision60.urdf", {}),
    "kuka_iiwa": ("kuka_iiwa/model.urdf", {"fixed": True}),
    "franka_panda": ("franka_panda/panda.urdf", {"fixed": True, "lock": ("panda_finger*",)}),
    "ant": ("ant.xml", {}),
}
"""File of each robot, and the options without which it is refused."""

STANCES: dict[str, dict[str, Any]] = {
    "a1": {"start": {"*_upper_joint": 0.9, "*_lower_joint": -1.8}},
    "laikago": {"turn": (np.pi / 2, 0, 0), "start": {"*_upper_leg_2*": 0.6, "*_lower_leg_2*": -1.2}},
    "aliengo": {"start": {"*_upper_joint": 0.8, "*_lower_joint": -1.6}},
    "mini_cheetah": {"start": {"abduct*": -0.8, "thigh*": 1.6}},
    "vision60": {"start": {"[0246]": 0.8, "[1357]": 1.5}},
    "minitaur": {"start": {"motor_*": np.pi / 2, "knee_*": -2.1834}},
    "kuka_iiwa": {"start": {"*_2": 0.5, "*_4": -1.0}},
    "franka_panda": {},
}
"""Options that let each robot start where it can stay, with its motors at rest."""


FEW = {"a1", "franka_panda", "ant"}
"""One that walks, one that is fixed, and one in MJCF; the others are for a release."""


def for_each(names: Iterable[str]) -> Any:
    """Parametrize a test by the names of robots."""
    return pytest.mark.parametrize(
        "name", [each if each in FEW else pytest.param(each, marks=pytest.mark.release) for each in names]
    )


def imported(name: str) -> ImportedFile:
    """Return a robot as it can stay at its start."""
    file, options = FILES[name]
    return import_robot(path_of(file), ImportOptions(name=name, **options, **STANCES.get(name, {})))


def path_of(file: str) -> Path:
    """Return the path of a file of the packages.

    Raises:
        ModuleNotFoundError: the package is not installed.
    """
    if file.endswith(".xml"):
        return Path(str(import_module("gymnasium").__file__)).parent / "envs" / "mujoco" / "assets" / file
    return Path(import_module("pybullet_data").getDataPath()) / file
