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

from gaplab.api.clients.bodies import json_of, numbers_of, readings_of
from gaplab.api.clients.driving import DriverMotion, Take, TakeLost, TakenRequest
from gaplab.api.clients.errors import ServiceError
from gaplab.schemas.records import SensorsRead

POLL_S = 0.1
"""Seconds between two looks whether a run may go on."""

STOP_S = 10.0
"""Longest time of a stop."""


class MeasurementFailed(Exception):
    """Raised by a driver that could not measure: the controller counts as tried, but simulators are not tuned on it."""


class DriverBroken(Exception):
    """A driver that cannot be loaded, returns what is not a fitness, or hangs; nothing wrong is sent."""


class Driver(Protocol):
    """The class that a driver file defines: it runs motions on a robot."""

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
    """A driver whose run and stop have threads of their own, so that one that hangs holds up nothing."""

    def __init__(self, driver: Driver, stop_s: float = STOP_S) -> None:
        self.connect = driver.connect
        self._driver, self._stop_s = driver, stop_s
        self._run, self._hangs = _Call(lambda: None), False

    def run(self, motion: DriverMotion, take: Take, limit_s: float) -> Any:  # noqa: ANN401 - whatever a driver returns
        """Return what the driver returns; raise TakeLost, MeasurementFailed, or DriverBroken if it hangs or fails."""
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
        """Stop the robot, and wait for the end of its run; once, raise DriverBroken if it may still move."""
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


def measure(task: TakenRequest, robot: Robot, limit_s: float | None, tell: Callable[[str], None]) -> None:
    """Run a taken request to its end: all repeats that an earlier run did not measure, then the answer.

    If others may have the robot, or the request is no longer needed, it ends without an answer.

    Args:
        task: the taken request.
        robot: what runs its motion.
        limit_s: longest time of one run; None: a minute more than ten times the motion.
        tell: is told what happens.

    Raises:
        DriverBroken: the driver hangs or answers nonsense. If the robot may still move, the take is left to its lease.
        ServiceError: the service refuses the answer, and would refuse the next one.
    """
    limit_s = limit_s or 60.0 + 10.0 * task.motion.observe_s[-1]
    try:
        _answer(task, robot, limit_s, tell)
    except ServiceError as error:
        if error.problem.status not in {404, 409}:
            raise
        tell(f"not taken: {error}")
    except BaseException as error:
        try:
            robot.stop()
        except DriverBroken as unstopped:
            task.take.leave()
            raise DriverBroken(f"{unstopped}; {error}".removesuffix("; ")) from error
        if not isinstance(error, TakeLost):
            raise
        if task.take.refused:
            task.forget()
        tell(f"stopped: {error}")


def _answer(task: TakenRequest, robot: Robot, limit_s: float, tell: Callable[[str], None]) -> None:
    """Measure the repeats that are missing, and answer."""
    found = [(value, readings) for value, readings in task.known if not _mistake_of(readings, task.sensors)]
    if found:
        tell(f"{len(found)} of {task.repeats} repeats are in the journal already")
    try:
        while len(found) < task.repeats:
            task.take.ask()
            value, readings = _checked(robot.run(task.motion, task.take, limit_s))
            if mistake := _mistake_of(readings, task.sensors):
                raise DriverBroken(f"the driver's run returned {mistake}")
            task.note(value, readings)
            found.append((value, readings))
            tell(f"repeat {len(found)} of {task.repeats}: {value:.6g} {task.request.unit}")
    except MeasurementFailed as failure:
        task.fail(str(failure) or "the driver could not measure it")
        tell(f"failed: {failure}")
        return
    tables = [readings for _, readings in found]
    answer = task.tell([value for value, _ in found], None if None in tables else tables)
    for doubt in answer.doubts:
        tell(f"doubtful: {doubt}; correct {answer.id}, or confirm it")


def _checked(answer: Any) -> tuple[float, Any]:  # noqa: ANN401 - whatever a driver returns
    """Return fitness and readings.

    Raises:
        DriverBroken: the fitness is not a finite number, or readings are not numbers.
    """
    readings: Any
    fitness, readings = answer if isinstance(answer, tuple) and len(answer) == 2 else (answer, None)
    try:
        (value,) = numbers_of([fitness], "/fitness")
    except TypeError as error:
        msg = f"the driver's run returned {answer!r:.100}; it must return the fitness, a number"
        raise DriverBroken(msg) from error
    except ValueError as error:
        msg = f"the driver's run returned {fitness}; raise MeasurementFailed if nothing was measured"
        raise DriverBroken(msg) from error
    try:
        return value, json_of(readings_of(readings), "/readings")
    except (TypeError, ValueError) as error:
        raise DriverBroken(f"the driver's run returned readings that cannot be sent: {error}") from error


def _mistake_of(readings: Any, sensors: SensorsRead | None) -> str | None:  # noqa: ANN401 - whatever a driver returns
    """Return why the service would refuse readings, after the last repeat; None if it would not."""
    if sensors is None or (readings is None and not sensors.needed):
        return None
    times_s, names = sensors.times_s, sensors.names
    if not names:
        return "readings, but the robot has no sensors: return the fitness alone"
    rows = f"{len(times_s)} rows of {len(names)} numbers"
    shape = f"{rows}: {', '.join(names)}, at {len(times_s)} times from {times_s[0]:g} to {times_s[-1]:g} s"
    if readings is None:
        msg = f"return (fitness, readings), {shape}; or answer with `gaplab traces REQUEST FILE --answer`"
        return f"no readings, but the experiment tunes on them: {msg}"
    if not _has_shape(readings, len(times_s), len(names)):
        return f"readings of another shape than the sensors'; return {shape}"
    return None


def _has_shape(readings: Any, rows: int, columns: int) -> bool:  # noqa: ANN401 - whatever a driver returns
    try:
        return len(readings) == rows and all(len(row) == columns for row in readings)
    except TypeError:
        return False
