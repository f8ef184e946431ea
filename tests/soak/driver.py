"""A driver for `gaplab drive` whose robot is an engine: each motor command is in the journal of the soak."""

import os
import time
from threading import Event
from typing import Any

from gaplab import MeasurementFailed
from tests import pretended_robot
from tests.soak.plugins.rig import JOURNAL

ROBOT = "GAPLAB_SOAK_ROBOT"  # environment variable with its name

COMMANDS, EVERY_S = 100, 0.05
"""Of one run, which lasts longer than a take without a sign of life, and than others need to take over."""


class Driver(pretended_robot.Driver):
    """It moves the robot until it is told to stop; a robot that was stopped cannot be measured."""

    def __init__(self) -> None:
        super().__init__(pretended_robot.Settings(engine="pybullet"))
        self._stopped, self._run = Event(), 0

    def run(self, motion: Any) -> float:
        self._stopped.clear()
        self._run += 1
        for _ in range(COMMANDS):
            if self._stopped.is_set():
                raise MeasurementFailed("the robot was stopped")
            self._note("moves")
            time.sleep(EVERY_S)
        fitness = super().run(motion)
        self._note(repr(fitness))
        return fitness

    def stop(self) -> None:
        self._stopped.set()
        self._note("stop")

    def _note(self, what: str) -> None:
        with open(os.environ[JOURNAL], "a") as file:
            file.write(f"{time.monotonic()} {os.environ[ROBOT]} {os.getpid()}.{self._run} {what}\n")
