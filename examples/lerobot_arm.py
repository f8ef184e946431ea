"""A driver for `gaplab drive`: an arm of LeRobot, here an SO-101. What is in capitals is yours."""

import atexit
import time
from operator import itemgetter
from threading import Event

import numpy as np
from lerobot.motors import MotorNormMode as Mode
from lerobot.robots.so_follower import SO101Follower, SO101FollowerConfig

from gaplab import DriverMotion, MeasurementFailed, read_robot

ROBOT = "so101.json"  # of `gaplab robot import so101.urdf --fixed`; its joints have the names of the motors
CONFIG = SO101FollowerConfig(port="/dev/ttyACM0", id="follower")
TURNED: set[str] = set()  # motors whose values fall where the angles of their joints grow
MOVE_S, BEGIN_S, RATE_HZ = 3.0, 4.0, 100.0  # it is at the start after MOVE_S, and rests until BEGIN_S


class Driver:
    """Sends targets in the units of the motors, and rates the angles that it observes."""

    def connect(self) -> None:
        """Connect to the arm, which `lerobot-calibrate` has calibrated."""
        self.robot, self.arm, self.stopped = read_robot(ROBOT), SO101Follower(CONFIG), Event()
        self.arm.connect(calibrate=False)
        atexit.register(self.arm.disconnect)

    def run(self, motion: DriverMotion) -> float | tuple[float, np.ndarray]:
        """Move slowly to the start, rest, run the motion, and return its fitness, perhaps with readings."""
        assert set(motion.units) == {"rad"}, f"angles are sent, not {motion.units}"
        keys, units = [f"{name}.pos" for name in motion.actuators], [self.unit(name) for name in motion.actuators]
        (per_rad, zero), seen = np.array(units).T, itemgetter(*keys)
        start, *goals = np.array([[motion.start[name] for name in motion.actuators], *motion.targets]) * per_rad + zero
        here, now, begin_s, record = seen(self.arm.get_observation()), -BEGIN_S, time.monotonic() + BEGIN_S, []
        self.stopped.clear()
        while now < motion.observe_s[-1]:
            moving = start + max(0.0, (MOVE_S - BEGIN_S - now) / MOVE_S) * (here - start)
            goal = moving if now < 0 else goals[np.searchsorted(motion.times_s, now, "right") - 1]
            if stopped := self.stopped.is_set():
                goal = np.array(seen(self.arm.get_observation()))
            sent = self.arm.send_action(dict(zip(keys, goal.tolist(), strict=True)))
            if stopped or any(abs(seen(sent) - goal) > 0.1):
                raise MeasurementFailed("it was stopped, or LeRobot limited a target (max_relative_target)")
            record.append((now := time.monotonic() - begin_s, *seen(self.arm.get_observation())))
            time.sleep(1 / RATE_HZ)
        times_s, angles = np.array(record)[:, 0], (np.array(record)[:, 1:] - zero) / per_rad
        return self.robot.rated(times_s, dict(zip(motion.actuators, angles.T, strict=True)))

    def unit(self, name: str) -> tuple[float, float]:
        """Return a motor's value per rad, in degrees or percent, and at 0 rad, the middle of its calibrated range."""
        bus, motor, known = self.arm.bus, self.arm.bus.motors[name], self.arm.bus.calibration[name]
        half = np.pi * (known.range_max - known.range_min) / (bus.model_resolution_table[motor.model] - 1)
        units = {Mode.DEGREES: (180 / np.pi, 0.0), Mode.RANGE_M100_100: (100 / half, 0.0)}
        per_rad, zero = units.get(motor.norm_mode, (50 / half, 50.0))
        return -per_rad if name in TURNED else per_rad, zero

    def stop(self) -> None:
        """Let the arm hold; the run does it, as the bus is for one thread."""
        self.stopped.set()
