"""Tunables by path in each engine: they change what a robot does, whatever ran before, as if it were built so."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.services.engines import engines
from gaplab.services.specs.assembly import edits_of
from gaplab.services.specs.defaults import honoured
from gaplab.services.specs.simulation import Simulation
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.tunables.labels import tunable_of

EDITS = {
    "mass(trunk)": 1.3,
    "mass(*_shin, as=value)": 0.3,
    "center_of_mass(trunk)": 0.04,
    "length_scale(*_shin, what=places)": 1.1,
    "joint_damping(*_knee)": 0.3,
    "joint_friction": 0.3,
    "armature": 0.02,
    "motor_gain": 2.0,
    "max_torque": 0.2,
    "slope": 0.1,
    "gravity_tilt(y)": 0.1,
    "ground_height": -0.05,
    "joint_static_friction": 3.0,
    "time_offset": 0.1,
    "noise": 0.1,
}
"""Labels, each with a value that is far from the robot's own."""


def pairs() -> Iterator[Any]:
    for name, engine in engines.items():
        if engine.available() and engine.runs(Quadruped().world):
            yield from (
                pytest.param(engine, label, id=f"{name}-{label}")
                for label in EDITS
                if honoured(tunable_of(label), engine)
            )


@pytest.mark.parametrize(("engine", "label"), list(pairs()))
def test_a_tunable_acts_as_if_the_robot_were_built_so(engine: Any, label: str) -> None:
    robot, tunable, value = Quadruped(), tunable_of(label), EDITS[label]
    nominal = tunable.read(robot.world)
    warm, fresh = (Simulation(robot, engine(), [tunable]) for _ in range(2))
    between = np.array([[nominal], [(nominal + value) / 2], [value]])

    usual, _, edited = warm(robot.known[None], between)[0]

    assert np.isfinite([usual, edited]).all()
    assert abs(edited - usual) > 1e-4
    assert fresh(robot.known[None], np.array([[value]]))[0, 0] == edited
    if tunable.field != "noise":  # which is put into the motion
        built = Quadruped()
        built.world = replace(tunable.edit(robot.world, value), origin=None, edits=frozenset())
        assert Simulation(built, engine(), ())(robot.known[None], np.empty((1, 0)))[0, 0] == edited


@pytest.mark.parametrize("name", ["pybullet", "mujoco"])
def test_several_tunables_at_once_depend_on_their_values_alone(name: str) -> None:
    labels = ["mass(trunk)", "length_scale(*_shin, what=shapes)", "max_torque", "noise", "time_offset"]
    values = np.array([[1.2, 1.05, 0.4, 0.02, 0.1], [0.8, 1.0, 1.0, 0.0, -0.1], [1.2, 0.95, 0.4, 0.02, 0.1]])
    robot = Quadruped()

    together = Simulation(robot, engines[name](), edits_of(labels))(robot.known[None], values)[0]

    for row, fitness in zip(values[::-1], together[::-1], strict=True):
        alone = Simulation(robot, engines[name](), edits_of(labels))(robot.known[None], row[None])
        assert alone[0, 0] == fitness
