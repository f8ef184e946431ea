"""Drivers: a Python file with the class `Driver`, which runs a motion on a robot and returns its fitness.

    class Driver:
        def connect(self): ...            # once, before the first run
        def run(self, motion): ...        # return the fitness, or (fitness, readings); raise MeasurementFailed
        def stop(self): ...               # at once, from any thread: the robot must stand still

`gaplab drive EXPERIMENT --driver FILE` asks for requests and calls it.
"""

import importlib.util
import time
from collections.abc import Callable
from pathlib import Path
from threading import Thread
from typing import Any, Protocol

from gaplab.api.clients.motions import DriverMotion
from gaplab.api.clients.takes import Take, TakeLost

POLL_S = 0.1
"""Seconds between two looks whether a run may go on."""

STOP_S = 10.0
"""Longest time of a stop."""


class MeasurementFailed(Exception):
    """Raised by a driver whose robot could not be measured: the controller counts as tried, and teaches nothing."""


class DriverBroken(Exception):
    """A driver that cannot be loaded, returns what is no fitness, or hangs; nothing wrong is sent."""


class Driver(Protocol):
    """What drives a robot."""

    def connect(self) -> None:
        """Connect to the robot."""

    def run(self, motion: DriverMotion) -> float | tuple[float, Any]:
        """Run a motion once; return the fitness in the robot's unit, or `(fitness, readings)`.

        Readings have a row for each time at which the sensors are read, and a column for each sensor, in its unit; None
        or NaN where it failed. `client.experiment(ID).sensors` has times, names and units in this order.
        """

    def stop(self) -> None:
        """Stop the robot at once; called from another thread if a run must not go on."""


def load(file: Path) -> Driver:
    """Return the driver of a file.

    Raises:
        OSError: the file cannot be read.
        DriverBroken: the file cannot be imported, or has no complete class `Driver`.
    """
    file.read_bytes()
    spec = importlib.util.spec_from_file_location(file.stem, file)
    if spec is None or spec.loader is None:
        raise DriverBroken(f"{file} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        driver: Driver = module.Driver()
    except AttributeError as error:
        raise DriverBroken(f"{file} has no class `Driver` that can be created without arguments: {error}") from error
    except Exception as error:
        raise DriverBroken(f"{file} cannot be used: {type(error).__name__}: {error}") from error
    if missing := [name for name in ("connect", "run", "stop") if not callable(getattr(driver, name, None))]:
        raise DriverBroken(f"the driver in {file} lacks {', '.join(missing)}; it needs connect, run and stop")
    return driver


class Robot:
    """A driver, each call of which has a thread of its own, so that one that hangs holds up nothing.

    Args:
        driver: what runs motions.
        stop_s: longest time of a stop.
    """

    def __init__(self, driver: Driver, stop_s: float = STOP_S) -> None:
        self.connect = driver.connect
        self._driver, self._stop_s = driver, stop_s
        self._run, self._hangs = _Call(lambda: None), False

    def run(self, motion: DriverMotion, take: Take, limit_s: float) -> Any:  # noqa: ANN401 - whatever a driver returns
        """Return what a run returns.

        Raises:
            TakeLost: others may drive the robot now or soon, so it must be stopped.
            MeasurementFailed: the driver says so.
            DriverBroken: the run took too long, or raised another error.
        """
        self._run = run = _Call(self._driver.run, motion)
        until = time.monotonic() + limit_s
        while run.is_alive() and not take.lost and time.monotonic() < until:
            run.join(POLL_S)
        if take.lost:
            raise TakeLost(take.lost)
        if run.is_alive():
            msg = f"the driver's run took more than {limit_s:g} s, so the robot was stopped; `--limit-s` permits more"
            raise DriverBroken(msg)
        if isinstance(run.error, MeasurementFailed):
            raise run.error
        if run.error:
            raise DriverBroken(f"the driver's run raised {type(run.error).__name__}: {run.error}") from run.error
        return run.answer

    def stop(self) -> None:
        """Stop the robot, and wait for the end of its run; a call that hangs is told once.

        Raises:
            DriverBroken: the stop hangs or raises an error, or the run goes on, so the robot may still move.
        """
        if self._hangs:
            return
        stop = _Call(self._driver.stop)
        for call, name in ((stop, "stop"), (self._run, "run")):
            call.join(self._stop_s)
            if call.is_alive():
                self._hangs = True
                msg = f"the driver's {name} has not returned {self._stop_s:g} s after a stop: the robot may still move"
                raise DriverBroken(msg)
        if stop.error:
            raise DriverBroken(f"the driver's stop raised {type(stop.error).__name__}: {stop.error}") from stop.error


class _Call(Thread):
    """A call in a thread, with what it returned or raised."""

    def __init__(self, function: Callable[..., Any], *arguments: object) -> None:
        super().__init__(name="driver", daemon=True)
        self.answer: Any = None
        self.error: BaseException | None = None
        self._function, self._arguments = function, arguments
        self.start()

    def run(self) -> None:
        """Call the function."""
        try:
            self.answer = self._function(*self._arguments)
        except BaseException as error:  # noqa: BLE001 - whoever waits for the call raises it again
            self.error = error
