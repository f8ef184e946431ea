"""The drivers of `examples/` for arms of LeRobot and of ROS 2, tried against arms that are pretended.

The pretended modules have the interfaces of lerobot 0.6 and of rclpy, with the units and the rules of the real ones: a
bus of LeRobot counts ticks, and a controller of ros2_control refuses a trajectory that it cannot follow.
"""

import sys
from collections.abc import Callable, Sequence
from enum import StrEnum
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gaplab import DriverMotion, MeasurementFailed, read_robot
from gaplab.api.clients import drivers
from tests.drawn_arm import imported

pytest.importorskip("mujoco")

EXAMPLES = Path(__file__).parents[2] / "examples"
NAMES = ("shoulder_lift", "elbow_flex")
CHANGES_S, TARGETS = (0.0, 0.6), ((0.2, -0.3), (0.5, 0.4))
STARTS = (0.1, -0.1)
TICK = 2 * np.pi / 4095
STATE = "sensor_msgs/msg/JointState"


@pytest.fixture(autouse=True)
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The arm, whose file is where the drivers look for it."""
    for name in ("so101", "arm"):
        imported(tmp_path, name, shoulder=NAMES[0], elbow=NAMES[1])
    monkeypatch.chdir(tmp_path)
    return read_robot("arm.json")


@pytest.fixture
def motion(robot: Any) -> DriverMotion:
    observe_s = tuple(robot.motion(robot.known).observe_s.tolist())
    return DriverMotion(NAMES, ("rad", "rad"), CHANGES_S, TARGETS, observe_s, dict(zip(NAMES, STARTS, strict=True)))


def told_by_angles(robot: Any) -> tuple[float, Any]:
    """Fitness and readings of the motion, from the place of the tool on a circle of 0.3 m about the shoulder."""
    places = [[0.3 * np.cos(a), 0.0, robot.world.start_height_m + 0.5 - 0.3 * np.sin(a)] for a, _ in TARGETS]
    fitness = -float(np.linalg.norm(np.array(places[1]) - [0.3, 0.2, 0.5]))
    return fitness, np.array([places[int(time_s >= CHANGES_S[1])] for time_s in robot.sensors.times_s])


def modules(monkeypatch: pytest.MonkeyPatch, **contents: Any) -> None:
    """Let `import` find pretended modules; a double underscore in a name stands for a dot."""
    for name, content in contents.items():
        module = ModuleType(name.replace("__", "."))
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, module.__name__, module)


class Mode(StrEnum):
    RANGE_0_100 = "range_0_100"
    RANGE_M100_100 = "range_m100_100"
    DEGREES = "degrees"


class Clock:
    """A clock of its own, which goes on while a driver sleeps; something may happen at a time."""

    now, at, happens = 100.0, np.inf, staticmethod(lambda: None)

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds
        if self.now >= self.at:
            self.at = np.inf
            self.happens()


class Bus:
    """Motors that turn at once to the ticks that they are told; `angles` are those of the joints, rad."""

    def __init__(self, mode: Mode, clock: Clock) -> None:
        self.motors = {name: SimpleNamespace(norm_mode=mode, model="sts3215") for name in (*NAMES, "gripper")}
        calibrated = {"range_min": 900, "range_max": 3101, "drive_mode": 0, "homing_offset": 0, "id": 1}
        self.calibration = {name: SimpleNamespace(**calibrated) for name in self.motors}
        self.ticks = dict.fromkeys(self.motors, 2000)
        self.turned: set[str] = set()
        self.model_resolution_table = {"sts3215": 4096}
        self.history = list[tuple[float, Any]]()
        self._clock = clock

    def sync_read(self) -> dict[str, float]:
        return {name: self._value(name, ticks) for name, ticks in self.ticks.items()}

    def sync_write(self, values: dict[str, float]) -> None:
        for name, value in values.items():
            assert type(value) is float
            self.ticks[name] = self._ticks(name, value)
        self.history.append((self._clock.now, self.angles))

    @property
    def angles(self) -> list[float]:
        return [(-1 if name in self.turned else 1) * (self.ticks[name] - 2000.5) * TICK for name in NAMES]

    def _unit(self, name: str) -> tuple[float, float]:
        """Return the value of a tick, and the ticks at the value 0."""
        low, high = self.calibration[name].range_min, self.calibration[name].range_max
        shares = {
            Mode.RANGE_M100_100: (200 / (high - low), (low + high) / 2),
            Mode.RANGE_0_100: (100 / (high - low), low),
        }
        return shares.get(self.motors[name].norm_mode, (360 / 4095, (low + high) / 2))

    def _value(self, name: str, ticks: int) -> float:
        per_tick, zero = self._unit(name)
        return (ticks - zero) * per_tick

    def _ticks(self, name: str, value: float) -> int:
        per_tick, zero = self._unit(name)
        ticks, known = int(value / per_tick + zero), self.calibration[name]
        within = min(known.range_max, max(known.range_min, ticks))
        return ticks if self.motors[name].norm_mode is Mode.DEGREES else within


class Follower:
    """An arm with the interface of LeRobot's `Robot`."""

    bus: Bus
    max_relative_target: float | None = None

    def __init__(self, config: Any) -> None:
        assert config.port
        self.is_connected, self.is_calibrated = False, True

    def connect(self, calibrate: bool = True) -> None:
        assert not self.is_connected
        assert not calibrate, "it would ask a person"
        self.is_connected = True

    def get_observation(self) -> dict[str, Any]:
        assert self.is_connected
        return {f"{name}.pos": value for name, value in self.bus.sync_read().items()} | {"front": np.zeros((2, 2, 3))}

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        assert self.is_connected
        goal, here = {key.removesuffix(".pos"): value for key, value in action.items()}, self.bus.sync_read()
        if (most := self.max_relative_target) is not None:
            goal = {name: here[name] + min(most, max(-most, value - here[name])) for name, value in goal.items()}
        self.bus.sync_write(goal)
        return {f"{name}.pos": value for name, value in goal.items()}

    def disconnect(self) -> None:
        self.is_connected = False


@pytest.fixture
def lerobot(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[Any, Bus, Clock]]:
    """Return a connected driver, its bus and its clock."""

    def connected(mode: Mode = Mode.DEGREES, turned: tuple[str, ...] = ()) -> tuple[Any, Bus, Clock]:
        clock = Clock()
        monkeypatch.setattr(Follower, "bus", Bus(mode, clock), raising=False)
        config = {"SO101Follower": Follower, "SO101FollowerConfig": SimpleNamespace}
        modules(monkeypatch, lerobot={}, lerobot__motors={"MotorNormMode": Mode}, lerobot__robots__so_follower=config)
        driver: Any = drivers.load(EXAMPLES / "lerobot_arm.py")
        named = type(driver).run.__globals__
        named["time"], named["TURNED"] = clock, set(turned)
        Follower.bus.turned = set(turned)
        monkeypatch.setattr("atexit.register", lambda _: None)
        driver.connect()
        return driver, Follower.bus, clock

    return connected


@pytest.mark.parametrize("mode", Mode)
@pytest.mark.parametrize("turned", [(), NAMES[1:]])
def test_an_arm_of_lerobot_runs_the_motion_in_the_units_of_its_motors(
    robot: Any, motion: DriverMotion, lerobot: Any, mode: Mode, turned: Any
) -> None:
    driver, bus, clock = lerobot(mode, turned)
    expected, places = told_by_angles(robot)
    began_s = clock.now

    fitness, readings = driver.run(motion)

    assert fitness == pytest.approx(expected, abs=2e-3)
    assert np.allclose(readings, places, atol=2e-3)
    speeds = [
        abs(np.subtract(after, before)).max() / 0.01
        for (time_s, before), (_, after) in zip(bus.history, bus.history[1:], strict=False)
        if time_s < began_s + 3.9
    ]
    assert max(speeds) < 0.5, "it moves slowly to the start"
    at_rest = [angles for time_s, angles in bus.history if began_s + 3.1 < time_s < began_s + 3.9]
    assert np.allclose(at_rest, STARTS, atol=2 * TICK)
    assert np.allclose(bus.angles, TARGETS[1], atol=2 * TICK)
    assert bus.ticks["gripper"] == 2000


def test_an_arm_of_lerobot_that_is_stopped_holds_where_it_is(motion: DriverMotion, lerobot: Any) -> None:
    driver, bus, clock = lerobot()
    clock.at, clock.happens = clock.now + 4.3, driver.stop

    with pytest.raises(MeasurementFailed, match="stopped"):
        driver.run(motion)

    assert clock.now < 104.4
    assert np.allclose(bus.angles, TARGETS[0], atol=3 * TICK)


def test_a_motion_that_lerobot_limits_is_not_measured(
    motion: DriverMotion, lerobot: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    driver, _, _ = lerobot()
    monkeypatch.setattr(Follower, "max_relative_target", 5.0)

    with pytest.raises(MeasurementFailed, match="max_relative_target"):
        driver.run(motion)


class Ns(int):
    """A time of ROS, in nanoseconds."""

    @property
    def nanoseconds(self) -> int:
        return int(self)

    def __add__(self, other: int) -> "Ns":
        return Ns(int(self) + int(other))

    def to_msg(self) -> Any:
        return SimpleNamespace(sec=self // 10**9, nanosec=self % 10**9)


def ns(stamp: Any) -> int:
    return stamp.sec * 10**9 + stamp.nanosec


def trajectory(joint_names: Sequence[str] = (), points: Sequence[Any] = ()) -> Any:
    """Return a message, of which rclpy has the type."""
    return SimpleNamespace(header=SimpleNamespace(stamp=Ns().to_msg()), joint_names=joint_names, points=points)


class Ros:
    """A node, the joint_trajectory_controller of two joints, and their broadcaster, at 250 Hz of a clock of its own."""

    def __init__(self) -> None:
        self.now_ns, self.angles, self.listeners = 1_700_000_000 * 10**9, [0.0, 0.0], 1
        self.accepted = list[Any]()
        self._heard: Any = None
        self._line: Any = None
        self.at_s, self.happens = np.inf, lambda: None

    def create_publisher(self, kind: Any, topic: str, qos_profile: int) -> Any:
        assert (kind, topic) == (trajectory, "/joint_trajectory_controller/joint_trajectory")
        return SimpleNamespace(publish=self.take, get_subscription_count=lambda: self.listeners)

    def create_subscription(self, kind: Any, topic: str, callback: Any, qos_profile: int) -> None:
        assert (kind, topic) == (STATE, "/joint_states")
        self._heard = callback

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: Ns(self.now_ns))

    def take(self, message: Any) -> None:
        """Follow a trajectory from now on, by lines from where the joints are; ignore an empty one, or of others."""
        if sorted(message.joint_names) != sorted(NAMES) or not message.points:
            return
        assert {type(each) for point in message.points for each in point.positions} == {float}, "rclpy takes no others"
        start_ns = ns(message.header.stamp) or self.now_ns
        times = [start_ns + ns(point.time_from_start) for point in message.points]
        assert all(np.diff([self.now_ns, *times]) > 0), "times ascend, and none is over"
        order = [message.joint_names.index(name) for name in NAMES]
        rows = [self.angles, *([point.positions[place] for place in order] for point in message.points)]
        self._line = np.array([self.now_ns, *times]), np.array(rows)
        self.accepted.append(message)

    def spin_once(self, node: Any, *, timeout_sec: float) -> None:
        self.now_ns += 4_000_000
        if self._line is not None:
            self.angles = [float(np.interp(self.now_ns, self._line[0], column)) for column in self._line[1].T]
        if (self.now_ns - 1_700_000_000 * 10**9) / 1e9 >= self.at_s:
            self.at_s = np.inf
            self.happens()
        header = SimpleNamespace(stamp=Ns(self.now_ns).to_msg())
        for names, angles in ((["gripper", *reversed(NAMES)], [0.0, *reversed(self.angles)]), (["wheel"], [1.0])):
            self._heard(SimpleNamespace(header=header, name=names, position=angles))


@pytest.fixture
def ros(monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Ros]:
    """A connected driver, and what it is connected to."""
    made = Ros()
    signals = SimpleNamespace(NO=0)
    modules(
        monkeypatch,
        rclpy={
            "init": lambda *, signal_handler_options: None,
            "create_node": lambda _: made,
            "spin_once": made.spin_once,
        },
        rclpy__duration={"Duration": lambda *, seconds: Ns(int(seconds * 10**9))},
        rclpy__signals={"SignalHandlerOptions": signals},
        sensor_msgs={},
        sensor_msgs__msg={"JointState": STATE},
        trajectory_msgs={},
        trajectory_msgs__msg={"JointTrajectory": trajectory, "JointTrajectoryPoint": SimpleNamespace},
    )
    driver: Any = drivers.load(EXAMPLES / "ros2_arm.py")
    driver.connect()
    return driver, made


def test_an_arm_of_ros_2_runs_the_motion_and_is_rated_by_its_states(
    robot: Any, motion: DriverMotion, ros: tuple[Any, Ros]
) -> None:
    driver, node = ros
    expected, places = told_by_angles(robot)

    for _ in range(2):
        fitness, readings = driver.run(motion)

        assert fitness == pytest.approx(expected, abs=1e-6)
        assert np.allclose(readings, places, atol=1e-6)
    sent = node.accepted[0]
    assert [point.positions for point in sent.points[:2]] == [list(STARTS)] * 2
    assert sent.points[0].time_from_start.sec >= 3
    assert ns(sent.header.stamp) == 1_700_000_000 * 10**9


def test_an_arm_of_ros_2_that_is_stopped_holds_where_it_is(motion: DriverMotion, ros: tuple[Any, Ros]) -> None:
    driver, node = ros
    driver.stop()
    assert node.accepted == []
    node.at_s, node.happens = 1.5, driver.stop

    with pytest.raises(MeasurementFailed, match="stopped"):
        driver.run(motion)

    there = node.angles
    for _ in range(500):
        node.spin_once(node, timeout_sec=0.0)
    assert np.allclose(node.angles, there, atol=1e-3)
    assert 0.01 < there[0] < STARTS[0] - 0.01


def test_without_a_controller_or_states_nothing_is_measured(motion: DriverMotion, ros: tuple[Any, Ros]) -> None:
    driver, node = ros
    node.listeners = 0
    with pytest.raises(MeasurementFailed, match="hears /joint_trajectory_controller"):
        driver.run(motion)

    node.listeners, node._heard = 1, lambda _: None
    with pytest.raises(MeasurementFailed, match="nobody is heard on /joint_states"):
        driver.run(motion)


@pytest.mark.parametrize("name", ["lerobot_arm.py", "ros2_arm.py"])
def test_an_example_is_short(name: str) -> None:
    assert len((EXAMPLES / name).read_text().splitlines()) <= 60
