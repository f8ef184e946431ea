"""Motions as files: each target with its unit, and no file of a robot that has no motors."""

import csv
import json
from typing import Any

import numpy as np
import pytest
import yaml

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import Conflict
from gaplab.services.csv_tables import csv_text, read_csv
from gaplab.services.measuring import motion_files
from gaplab.services.specs.robots import Driven, robot_of

ROBOT = '''
"""A robot with every kind of motor."""

from gaplab.plugins import Body, Joint, Motion, Motor, PDMotor, Robot, Space, Sphere, World, frozen

MOTORS = {
    "servo": Motor(0.5, 1.0),
    "position": PDMotor("position", 1.0, kp=1.0),
    "velocity": PDMotor("velocity", 1.0, kd=1.0),
    "torque": PDMotor("torque", 1.0),
}


class Mixed(Robot):
    """A base with a hinge and a slide of each kind."""

    name = "mixed"
    engine = "analytic"
    unit = "m/s"
    space = Space.box([0.0] * 8, [1.0] * 8)
    known = frozen([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8])

    def __init__(self, options=None):
        super().__init__(options)
        kinds = [(name, slides) for name in MOTORS for slides in (False, True)]
        names = [f"{name} {'slide' if slides else 'hinge'}" for name, slides in kinds]
        self.world = World(
            bodies=tuple(Body(name, 1.0, Sphere(0.1)) for name in ("base", *names)),
            joints=tuple(
                Joint(name, "base", name, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), MOTORS[kind], slides=slides)
                for name, (kind, slides) in zip(names, kinds)
            ),
        )

    def motion(self, genome):
        return Motion(frozen([0.0]), genome[None, :], frozen([0.0, 1.0]))

    def fitness(self, trajectory):
        return trajectory.positions_m[..., -1, 0]
'''

UNITS = ["rad", "m", "rad", "m", "rad/s", "m/s", "N·m", "N"]


def written(robot: str, form: motion_files.MotionFormat) -> str:
    spec: Any = Driven(PluginRef(name=robot))
    return motion_files.written(spec, robot_of(spec).known, form)


def test_each_target_has_the_unit_of_what_its_motor_follows(put: Any) -> None:
    put(mixed=ROBOT)

    plain = json.loads(written("mixed", "json"))
    heading, rest, first, *_ = csv.reader(written("mixed", "csv").splitlines())

    assert plain["units"] == UNITS
    assert heading == ["time_s", *(f"{name} ({unit})" for name, unit in zip(plain["actuators"], UNITS, strict=True))]
    assert [float(cell) for cell in rest] == [-1.0, *[0.0] * 8]
    assert [float(target) for target in first[1:]] == plain["targets"][0] == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]
    with pytest.raises(Conflict, match=r"something else: velocity hinge \(velocity\), .*, torque slide \(torque\)"):
        written("mixed", "ros2")


def test_a_joint_in_the_csv_is_no_formula_and_is_read_with_its_name(put: Any) -> None:
    put(mixed=ROBOT.replace('"torque": PDMotor', '"=1+1": PDMotor'))

    text = written("mixed", "csv")

    assert next(csv.reader(text.splitlines()))[-2:] == ["'=1+1 hinge (N·m)", "'=1+1 slide (N)"]
    assert read_csv(text).header.cells[-2:] == ["=1+1 hinge (N·m)", "=1+1 slide (N)"]


def test_texts_in_csv_are_read_as_they_were_written() -> None:
    names = ["=1", "'=1", "''=1", "'plain", "+x", "-x", "@x", "it's", "a,b", '"']

    assert read_csv(csv_text(names, [])).header.cells == names


def test_a_trajectory_begins_at_rest_and_jumps_nowhere() -> None:
    spec: Any = Driven(PluginRef(name="quadruped"), controller=PluginRef(name="sine"))
    robot = robot_of(spec)
    text = motion_files.written(spec, robot.known, "ros2")
    points = yaml.safe_load(text)["points"]
    times = [each["time_from_start"]["sec"] + each["time_from_start"]["nanosec"] / 1e9 for each in points]
    targets = np.array([each["positions"] for each in points])
    motion: Any = robot.motion(robot.known)

    assert targets[0].tolist() == targets[1].tolist() == [joint.start for joint in robot.world.actuators]
    assert times[:4] == pytest.approx([0.0, 0.98, 1.0, 1.02])
    assert targets[2:-1].tolist() == motion.targets.tolist()
    speeds = np.abs(np.diff(targets, axis=0) / np.diff(times)[:, None]).max(axis=0)
    assert f"# {robot.world.actuators[0].name}: up to {speeds[0]:.3g} rad/s; its limit is 20.0\n" in text
    assert text.startswith("# The motion begins at 1 s. Before each repeat, move the joints slowly to the start pose (")


@pytest.mark.parametrize("form", ["csv", "json", "ros2"])
def test_a_robot_without_actuators_has_no_motion(form: motion_files.MotionFormat) -> None:
    assert motion_files.forms_of(robot_of(Driven(PluginRef(name="toy_function"))), frozen([0.3])) == ()

    with pytest.raises(Conflict, match="toy_function has no actuators, so its controller has no motion"):
        written("toy_function", form)
