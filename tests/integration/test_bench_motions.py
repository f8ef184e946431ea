"""Motions as files: each target with its unit, and no file of a robot that has no motors."""

import csv
import json
from typing import Any

import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.bench import motions
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import Conflict
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


def written(robot: str, form: motions.MotionFormat) -> str:
    spec: Any = Driven(PluginRef(name=robot))
    return motions.written(spec, robot_of(spec).known, form)


def test_each_target_has_the_unit_of_what_its_motor_follows(put: Any) -> None:
    put(mixed=ROBOT)

    plain = json.loads(written("mixed", "json"))
    heading, first, *_ = csv.reader(written("mixed", "csv").splitlines())

    assert plain["units"] == UNITS
    assert heading == ["time_s", *(f"{name} ({unit})" for name, unit in zip(plain["actuators"], UNITS, strict=True))]
    assert [float(target) for target in first[1:]] == plain["targets"][0] == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]
    with pytest.raises(Conflict, match=r"follow others: velocity hinge \(velocity\), .*, torque slide \(torque\)"):
        written("mixed", "ros2")


@pytest.mark.parametrize("form", ["csv", "json", "ros2"])
def test_a_robot_without_actuators_has_no_motion(form: motions.MotionFormat) -> None:
    assert motions.forms_of(robot_of(Driven(PluginRef(name="toy_function"))), frozen([0.3])) == ()

    with pytest.raises(Conflict, match="toy_function has no actuators, so its controller has no motion"):
        written("toy_function", form)
