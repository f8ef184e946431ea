"""A pretended robot as reality, and the journal of the motor commands that it got.

A line of it: seconds, robot, drive (one run of one program), and what happened."""

import os
import time
from itertools import count
from threading import Event
from typing import Any

from gaplab.plugins import TryAgain
from gaplab.services.engines.analytic import Analytic

JOURNAL = "GAPLAB_SOAK_JOURNAL"
"""Environment variable with the file of the journal; without it nothing moves, and the fitness is the same."""

COMMANDS, EVERY_S = 10, 0.15
"""Of one measurement."""

DEAD_MAN_S = 1.0
"""Pause after which the motors stop by themselves, as those of a real robot do when its driver stands still."""

_drives = count()


class Rig(Analytic):
    """A robot on a bench, as gaplab sees one: an engine that may not be repeated."""

    name = "rig"
    repeatable = False
    batch = 1

    def __init__(self, options: Any = None) -> None:
        super().__init__(options)
        self._stopped = Event()

    def rollouts(self, worlds: Any, motions: Any) -> Any:
        if journal := os.environ.get(JOURNAL):
            self._drive(journal)
        return super().rollouts(worlds, motions)

    def stop(self) -> None:
        self._stopped.set()

    def _drive(self, journal: Any) -> None:
        drive, before = f"{os.getpid()}.{next(_drives)}", time.monotonic()
        for _ in range(COMMANDS):
            at = time.monotonic()
            if self._stopped.is_set() or at - before > DEAD_MAN_S:
                raise TryAgain("the robot's motors have stopped by themselves")
            with open(journal, "a") as file:
                file.write(f"{at} rig {drive} moves\n")
            before = at
            time.sleep(EVERY_S)
