"""A driver that cannot be stopped is told about, and nobody is invited to have its robot."""

from threading import Event, Lock
from types import SimpleNamespace
from typing import Any

import pytest

from gaplab.api.clients.drivers import DriverBroken, Robot, measure


class Driver:
    """Runs until `end` is set. Its stop waits for the run, or fails."""

    def __init__(self, error: Exception | None = None) -> None:
        self.lock, self.end, self.error, self.stops = Lock(), Event(), error, 0

    def connect(self) -> None:
        """Do nothing."""

    def run(self, motion: Any) -> float:
        with self.lock:
            self.end.wait()
        return 0.5

    def stop(self) -> None:
        self.stops += 1
        if self.error:
            self.end.set()
            raise self.error
        with self.lock:
            pass


@pytest.mark.parametrize(
    ("driver", "said"),
    [
        (Driver(), "the driver's stop has not returned 0.2 s after a stop: the robot may still move"),
        (Driver(OSError("no cable")), "the driver's stop raised OSError: no cable"),
    ],
)
def test_no_sign_of_life_is_given_for_a_robot_that_cannot_be_stopped(driver: Driver, said: str) -> None:
    left: list[int] = []
    take, motion = (
        SimpleNamespace(lost=None, ask=lambda: None, leave=lambda: left.append(1)),
        SimpleNamespace(observe_s=(3.0,)),
    )
    task: Any = SimpleNamespace(take=take, motion=motion, sensors=None, known=[], repeats=1)
    robot = Robot(driver, stop_s=0.2)

    with pytest.raises(DriverBroken) as told:
        measure(task, robot, 0.1, lambda sentence: None)
    if not driver.error:
        robot.stop()  # as at the end: it neither waits nor tells again

    driver.end.set()
    assert (
        str(told.value)
        == f"{said}; the driver's run took more than 0.1 s, so the robot was stopped; `--limit-s` permits more"
    )
    assert (left, driver.stops) == ([1], 1)
