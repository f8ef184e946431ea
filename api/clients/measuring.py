"""What `gaplab drive` does with a taken request: runs its motion, checks what the driver returns, and answers."""

from collections.abc import Callable
from typing import Any

from gaplab.api.clients.bodies import json_of, numbers_of, readings_of
from gaplab.api.clients.drivers import DriverBroken, MeasurementFailed, Robot
from gaplab.api.clients.driving import TakenRequest
from gaplab.api.clients.errors import ServiceError
from gaplab.api.clients.takes import TakeLost
from gaplab.schemas.records import SensorsRead

Tell = Callable[[str], None]


def measure(task: TakenRequest, robot: Robot, limit_s: float | None, tell: Tell) -> None:
    """Run a taken request to its end: all repeats that an earlier run did not measure, then the answer.

    If others may have the robot, or the request is not wanted any more, it ends without an answer.

    Args:
        task: the taken request.
        robot: what runs its motion.
        limit_s: longest time of one run; None: a minute more than ten times the motion.
        tell: is told what happens.

    Raises:
        DriverBroken: the driver hangs or answers nonsense. If the robot may still move, the take is left to its lease.
        ServiceError: the service refuses the answer, and would refuse the next one.
    """
    motion, sensors = task.motion, task.sensors
    limit_s = limit_s or 60.0 + 10.0 * motion.observe_s[-1]
    try:
        _answer(task, lambda: robot.run(motion, task.take, limit_s), sensors, tell)
    except ServiceError as error:
        if error.problem.status not in {404, 409}:
            raise
        tell(f"not taken: {error}")
    except BaseException as error:
        try:
            robot.stop()
        except DriverBroken as unstopped:
            task.take.over.set()
            raise DriverBroken(f"{unstopped}; {error}".removesuffix("; ")) from error
        if not isinstance(error, TakeLost):
            raise
        if task.take.refused:
            task.forget()
        tell(f"stopped: {error}")


def _answer(task: TakenRequest, run: Callable[[], Any], sensors: SensorsRead | None, tell: Tell) -> None:
    """Measure the repeats that are missing, and answer."""
    found = [(value, readings) for value, readings in task.known if not _mistake_of(readings, sensors)]
    if found:
        tell(f"{len(found)} of {task.repeats} repeats are in the journal already")
    try:
        while len(found) < task.repeats:
            task.take.ask()
            value, readings = _checked(run())
            if mistake := _mistake_of(readings, sensors):
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
        DriverBroken: the fitness is not a finite number, or readings are no numbers.
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
