"""The time left of a study or an experiment, from its pace since it was first seen."""

import math
import time
from collections.abc import Callable

from gaplab.api.clients.progress.text import fraction
from gaplab.api.clients.records import Record
from gaplab.schemas.lifecycle import State

KNOWN_AFTER_S = 10.0
"""Shortest time over which a pace is measured."""

KNOWN_FROM = 0.05
"""Smallest fraction of the rollouts over which a pace is measured."""

LOW, HIGH = 0.8, 1.25
"""Ends of the range, as factors of the estimate: the experiments of one study differ in pace by that much."""


class Pace:
    """The pace of a study and of each of its experiments, on the clock of the watcher.

    All progress since the start has the same weight, so that the range settles. The service's `seconds_left` is an
    estimate of one moment: it doubles whenever one of two repetitions starts.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._started: dict[str, tuple[float, float]] = {}

    def left(self, record: Record) -> str | None:
        """Return the range of the time left, like "2 to 4 min"; None while unknown and after the end."""
        if record.state is not State.RUNNING:
            self._started.pop(record.id, None)
            return None
        now, done = self._clock(), fraction(record.progress)
        if not done:
            self._started[record.id] = (now, done)
        started_at, before = self._started.setdefault(record.id, (now, done))
        if now - started_at < KNOWN_AFTER_S or done - before < KNOWN_FROM:
            return None
        return span((now - started_at) * (1 - done) / (done - before))


def span(seconds: float) -> str:
    """Return the range around an estimate in minutes, or in hours if it is long."""
    unit, name = (3600, "h") if seconds > 2 * 3600 else (60, "min")
    low, high = math.floor(LOW * seconds / unit), math.ceil(HIGH * seconds / unit)
    return f"{low} to {high} {name}" if low else f"less than {high} {name}"
