"""The robot of a spec: driven by its controller, rated by its task."""

from dataclasses import replace

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.specs.robots import Driven, robot_of, sensors, unit
from gaplab.services.world.kinematics import about, product
from gaplab.services.world.motions import Motion, Trajectory
from gaplab.services.world.robots.quadruped import Quadruped

QUADRUPED = PluginRef(name="quadruped")


def pulses(**options: float) -> PluginRef:
    return PluginRef(name="square_pulses", options=options)


def motion(driven: Driven) -> Motion:
    robot = robot_of(driven)
    found = robot.motion(robot.known)
    assert isinstance(found, Motion)
    return found


def test_the_robots_own_controller_and_task_are_those_that_it_names() -> None:
    own, named = motion(Driven(QUADRUPED)), motion(Driven(QUADRUPED, pulses(period_s=0.5), PluginRef(name="walk")))

    assert np.array_equal(own.times_s, named.times_s)
    assert np.array_equal(own.targets, named.targets)
    assert np.array_equal(own.observe_s, named.observe_s)


def test_a_controller_has_its_options_and_the_robots_own_task_stays() -> None:
    slow = motion(Driven(QUADRUPED, pulses(period_s=1.0, amplitude=0.5)))
    own = motion(Driven(QUADRUPED))

    assert np.abs(slow.targets).max() == np.abs(own.targets).max() / 2
    assert slow.times_s[1] == pytest.approx(2 * own.times_s[1])
    assert slow.observe_s.tolist() == [0.5, 3.0]


def test_a_task_says_how_long_a_rollout_lasts_and_what_is_fit() -> None:
    forward = PluginRef(name="walk", options={"counted_s": 1.0, "direction": "forward"})
    robot = robot_of(Driven(QUADRUPED, task=forward))
    found = robot.motion(robot.known)

    assert found.observe_s.tolist() == [0.5, 1.5]
    assert robot.sensors.times_s[-1] == 1.5
    assert np.array_equal(robot.known, Quadruped().known)


def test_a_robot_with_a_controller_of_its_own_takes_no_other() -> None:
    with pytest.raises(InvalidSpec, match="toy_function brings a controller and a task of its own") as raised:
        robot_of(Driven(PluginRef(name="toy_function"), pulses(), PluginRef(name="walk")))

    assert [each.pointer for each in raised.value.violations] == ["/controller", "/task"]


def test_all_mistakes_of_controller_and_task_are_told_at_once() -> None:
    spec = ExperimentSpec.model_validate(
        {"strategy": "random", "controller": "square_pulse", "task": {"name": "walk", "options": {"counted_s": -1.0}}}
    )
    with pytest.raises(InvalidSpec) as raised:
        resolve_experiment(spec)

    assert {each.pointer for each in raised.value.violations} == {"/controller", "/task/options/counted_s"}
    assert "square_pulses" in str(raised.value)


def test_a_resolved_spec_has_every_option_of_what_it_names_and_none_of_the_robots_own() -> None:
    named = resolve_experiment(ExperimentSpec.model_validate({"strategy": "random", "controller": "square_pulses"}))
    bare = resolve_experiment(ExperimentSpec.model_validate({"strategy": "random"}))

    assert named.controller == pulses(period_s=0.5, amplitude=1.0)
    assert (bare.controller, bare.task, named.task) == (None, None, None)


def test_the_unit_is_that_of_the_task() -> None:
    assert unit(Driven(QUADRUPED)) == "m/s"
    assert unit(Driven(QUADRUPED, task=PluginRef(name="walk"))) == "m/s"
    assert unit(Driven(PluginRef(name="nobody"))) == ""


@pytest.mark.parametrize(
    "driven",
    [
        Driven(QUADRUPED),
        Driven(PluginRef(name="quadruped", options={"counted_s": 1.0})),
        Driven(QUADRUPED, pulses()),
        Driven(QUADRUPED, task=PluginRef(name="walk", options={"counted_s": 1.0})),
        Driven(QUADRUPED, pulses(), PluginRef(name="reach")),
        Driven(PluginRef(name="toy_function")),
    ],
)
def test_the_sensors_are_those_of_the_robot_with_its_task(driven: Driven) -> None:
    own, told = robot_of(driven).sensors, sensors(driven)

    assert told is not None
    assert (told.names, told.units) == (own.names, own.units)
    assert (list(told.noises), list(told.times_s)) == (own.noises.tolist(), own.times_s.tolist())


def test_the_sensors_of_a_robot_that_is_not_installed_are_unknown() -> None:
    assert sensors(Driven(PluginRef(name="nobody"))) is None
    assert sensors(Driven(QUADRUPED, task=PluginRef(name="nothing"))) is None
    assert sensors(Driven(QUADRUPED, PluginRef(name="nobody"))) is not None


def test_a_base_that_begins_turned_is_level_at_the_start() -> None:
    turn = about(np.array([1.0, 0.0, 0.0]), np.array([np.pi / 2]))
    tilts = about(np.array([1.0, 0.0, 0.0]), np.array([0.1, 0.2])), about(np.array([0.0, 1.0, 0.0]), np.array([0.3]))
    robot = Quadruped()
    robot.world = replace(robot.world, start_turn=tuple(turn[0]))

    seen = product(np.concatenate(tilts), turn)
    found = robot.sense(Trajectory(np.arange(3.0), np.zeros((3, 3)), seen))

    assert found[:, :2] == pytest.approx(np.array([[0.1, 0.0], [0.2, 0.0], [0.0, 0.3]]))
