"""The driver that `gaplab plugin new driver` writes, from which people make their own."""

import ast
from dataclasses import replace
from pathlib import Path

import pytest

from gaplab import DriverMotion
from gaplab.api.clients import drivers
from gaplab.services.contract.checks import write_skeleton
from gaplab.services.world.motions import open_loop
from gaplab.services.world.robots.quadruped import Quadruped


@pytest.fixture
def motion() -> DriverMotion:
    """The known motion of the quadruped, as the service sends it."""
    robot = Quadruped()
    known, names = open_loop(robot.motion(robot.known)), tuple(joint.name for joint in robot.world.actuators)
    targets = tuple(map(tuple, known.targets.tolist()))
    return DriverMotion(names, ("rad",) * len(names), tuple(known.times_s), targets, tuple(known.observe_s))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write_skeleton("driver", "mylab", tmp_path)


def test_it_measures_its_robot_and_refuses_the_motion_of_another(file: Path, motion: DriverMotion) -> None:
    driver = drivers.load(file)
    driver.connect()
    other = replace(motion, actuators=("wheel",), targets=tuple(row[:1] for row in motion.targets))

    assert isinstance(driver.run(motion), float)
    with pytest.raises(ValueError, match=r"the motion is for \('wheel',\), but the quadruped has \('front_left_yaw'"):
        driver.run(other)


def test_it_imports_only_names_that_are_public(file: Path) -> None:
    imports = [node.module for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.ImportFrom)]

    assert {name for name in imports if name and name.startswith("gaplab")} == {"gaplab", "gaplab.plugins"}
