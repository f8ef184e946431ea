"""The safety forecast: extremes of rollouts, limits in words, and physics that fails."""

from dataclasses import replace
from math import cos, inf, nan, pi, sin
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.measurements import LimitsSpec, Safety
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.engines import engines
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.specs.simulation import SafetyForecast
from gaplab.services.world.motions import Motion, Recording, Trajectory
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.safety import Extremes, expected, extremes, recording_times, safety
from gaplab.services.world.world import World
from tests.experiments import toy

ROBOT = Quadruped()
STILL = Motion(frozen([0.0]), frozen(np.zeros((1, 12))), frozen([0.1]))
LIMITS = LimitsSpec(joint_speed=5.0, torque=3.0, tilt=0.5, height=0.1)


def tilted(*angles: float) -> Recording:
    """A recording of a base that tilts about x and stays 0.2 m high, with one joint that turns 0.1 rad a frame."""
    count = len(angles)
    turns = np.array([[sin(angle / 2), 0.0, 0.0, cos(angle / 2)] for angle in angles])
    poses = np.hstack([np.tile([0.0, 0.0, 0.2], (count, 1)), turns])
    trajectory = Trajectory(frozen([0.0]), poses[:1, :3], poses[:1, 3:])
    return Recording(trajectory, frozen(np.arange(count) * 0.01), poses, frozen(np.arange(count)[:, None] * 0.1))


def test_a_joint_may_turn_by_more_than_half_a_turn_between_two_observations() -> None:
    spun = replace(tilted(0.0, 0.0, 0.0), angles_rad=frozen([[0.0], [3.5], [7.0]]))

    assert extremes(ROBOT.world, STILL, spun, 0.4).joint_speed == pytest.approx(350.0)


def test_extremes_are_the_worst_of_a_rollout() -> None:
    found = extremes(ROBOT.world, STILL, tilted(0.0, 0.3, -0.6), 0.4)

    assert found.tilt == pytest.approx(0.6)
    assert found.joint_speed == pytest.approx(10.0)
    assert found.height == 0.2
    assert found.clearance == pytest.approx(0.2 - 0.1 * sin(0.6) - 0.03 * cos(0.6))
    assert np.isnan(found.torque)


def test_a_robot_that_starts_turned_is_upright_there() -> None:
    lying = tilted(pi / 2, pi / 2 + 0.3, pi / 2 - 0.6)

    world = replace(ROBOT.world, start_turn=tuple(lying.poses[0, 3:].tolist()))

    assert extremes(world, STILL, lying, 0.4).tilt == pytest.approx(0.6)
    assert extremes(ROBOT.world, STILL, lying, 0.4).tilt == pytest.approx(pi / 2 + 0.3)


def test_a_range_of_the_robot_file_and_a_fall_are_limits_that_nobody_needs_to_ask_for() -> None:
    hip, *others = ROBOT.world.joints
    world = replace(ROBOT.world, joints=(replace(hip, limits=(-0.2, 0.5)), *others))
    far = replace(STILL, targets=frozen(np.full((1, 12), -0.7)))
    (said,) = extremes(world, far, tilted(0.0, 0.1), 0.4).out_of_range

    assert said == f"{hip.name} is to go to -0.7 rad; its range is -0.2 to 0.5 rad"
    assert extremes(world, STILL, tilted(0.0, 0.1), 0.4).out_of_range == ()
    fell = Extremes(tilt=pi, fitness=0.1, out_of_range=(said,))
    assert safety([fell, fell], None, "mine").beyond == ("it falls in 2 of 2 simulators", said)
    assert safety([fell], LimitsSpec(tilt=3.2), "mine").beyond == (said,)


def test_what_simulators_expect_is_told_with_the_worst_of_them() -> None:
    found = Safety(simulators=3, failed=1, joint_speed=12.534, height=0.1, falls=2, fitness_low=0.3, fitness_high=0.5)

    assert list(expected(found, "m/s")) == [
        *("simulators expect 0.3 to 0.5 m/s", "the physics fails in 1 of 3 simulators"),
        *("it falls in 2 of 3 simulators", "the speed of a joint: at most 12.5 rad/s"),
        "the height of the base: at least 0.1 m",
    ]
    assert list(expected(Safety(simulators=1, failed=0, fitness_low=0.3, fitness_high=0.3), "")) == [
        "simulators expect 0.3"
    ]


def test_failed_physics_has_no_extremes() -> None:
    assert np.isnan(extremes(ROBOT.world, STILL, tilted(0.0, nan), 0.4).tilt)
    assert np.isnan(extremes(ROBOT.world, STILL, tilted(0.0), nan).tilt)


def test_the_forecast_is_the_worst_of_all_simulators_and_says_what_it_exceeds() -> None:
    calm = Extremes(1.0, 1.0, 0.1, 0.2, 0.1, fitness=0.4)
    wild = Extremes(9.0, 1.0, pi, 0.05, -0.01, fitness=0.9)
    found = safety([calm, wild, Extremes()], LIMITS, "mine")

    assert (found.simulators, found.failed, found.falls) == (3, 1, 1)
    assert (found.joint_speed, found.torque, found.tilt) == (9.0, 1.0, pi)
    assert (found.height, found.clearance) == (0.05, -0.01)
    assert (found.fitness_low, found.fitness_high) == (0.4, 0.9)
    assert found.beyond == (
        "the speed of a joint reaches 9 rad/s in 1 of 2 simulators; permitted: at most 5 rad/s",
        "the tilt of the base reaches 3.14 rad in 1 of 2 simulators; permitted: at most 0.5 rad",
        "the height of the base reaches 0.05 m in 1 of 2 simulators; permitted: at least 0.1 m",
    )
    assert found.unknown == ("the physics failed in 1 of 3 simulators",)


def test_a_limit_that_no_engine_can_check_is_said_to_be_unchecked() -> None:
    found = safety([Extremes(1.0, nan, 0.1, 0.2, 0.1, 0.4)], LIMITS, "mine")

    assert found.torque is None
    assert found.beyond == ()
    assert found.unknown == (
        "the engine mine does not tell the torque of a joint, so its limit of 3 N·m is not checked",
    )
    assert safety([Extremes()], LIMITS, "mine").beyond == ()


class _Broken:
    """A simulation whose physics raises an error."""

    def record(self, *_: Any) -> tuple[World, Recording]:
        raise ZeroDivisionError("the physics fell over")


def test_a_forecast_that_fails_is_told_and_raises_nothing() -> None:
    spec = resolve_experiment(quadruped())
    broken: Any = _Broken()
    found = SafetyForecast(spec, ROBOT, broken)(ROBOT.known, np.ones((30, 3)))

    assert (found.simulators, found.failed, found.beyond) == (20, 20, ())
    assert found.unknown[-1] == "ZeroDivisionError: the physics fell over"


def quadruped(**reality: Any) -> Any:
    physical = {"kind": "physical"} | reality
    return toy(robot="quadruped", engine="mujoco", reality=physical)


def test_a_forecast_of_physics_changes_no_number() -> None:
    spec = resolve_experiment(quadruped(limits={"joint_speed": 2.0, "torque": 100.0}))
    found, parameters = setting(spec, 0), np.array([[1.0, 0.8], [0.5, 0.3]])
    before = found.simulate(found.known[None], parameters)
    assert found.forecast is not None
    told = found.forecast(found.known, parameters, lambda: None)

    assert np.array_equal(found.simulate(found.known[None], parameters), before)
    assert (told.simulators, told.failed, told.falls) == (2, 0, 0)
    assert [told.fitness_low, told.fitness_high] == sorted(before[0])
    assert 2.0 < (told.joint_speed or nan) < 20.5
    assert len(told.beyond) == 1


@pytest.mark.parametrize("name", ["pybullet", "mujoco", "physx"])
def test_engines_tell_torques_within_the_strength_of_the_motors(name: str) -> None:
    if not engines[name].available():
        pytest.skip(f"{name} is not installed")
    engine, motion = engines[name](), ROBOT.motion(ROBOT.known)
    times = recording_times(motion, ROBOT.world)
    first, again = (engine.record(ROBOT.world, motion, times) for _ in range(2))

    assert first.torques_nm is not None
    assert again.torques_nm is not None
    assert first.torques_nm.shape == (len(times), len(ROBOT.world.joints))
    assert not first.torques_nm[0].any()
    assert 0.5 < np.abs(first.torques_nm).max() <= 8.01
    assert np.array_equal(first.torques_nm, again.torques_nm)
    assert np.array_equal(first.trajectory.positions_m, engine.rollout(ROBOT.world, motion).positions_m)


def test_a_robot_without_a_body_and_a_simulated_reality_have_no_forecast() -> None:
    assert setting(resolve_experiment(toy(reality={"kind": "physical"})), 0).forecast is None
    assert setting(resolve_experiment(toy()), 0).forecast is None


@pytest.mark.parametrize(
    ("spec", "pointers"),
    [
        (toy(reality={"kind": "physical", "limits": {"tilt": 0.5}}), {"/reality/limits"}),
        (toy(reality={"kind": "physical", "beyond": "refuse"}), {"/reality/beyond"}),
        (toy(reality={"limits": {"tilt": 0.5}, "beyond": "refuse"}), {"/reality/limits", "/reality/beyond"}),
    ],
    ids=["no body", "nothing to refuse", "simulated"],
)
def test_limits_that_nothing_checks_are_refused(spec: Any, pointers: set[str]) -> None:
    with pytest.raises(InvalidSpec) as refused:
        resolve_experiment(spec)
    assert {each.pointer for each in refused.value.violations} == pointers


@pytest.mark.parametrize("value", [0.0, -1.0, inf, nan, "5"])
def test_limits_are_positive_numbers(value: Any) -> None:
    with pytest.raises(ValueError, match="joint_speed"):
        LimitsSpec(joint_speed=value)
