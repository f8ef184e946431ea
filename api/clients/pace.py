"""The time left of what is watched, from how fast it went since the watching began."""

import math
import time
from collections.abc import Callable

from gaplab.api.clients import display
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import ExperimentRead, StudyRead

KNOWN_AFTER_S = 10.0
"""Time over which a pace must be seen before it says anything about the rest."""

KNOWN_FROM = 0.05
"""Part of the rollouts that must be done in that time."""

LOW, HIGH = 0.8, 1.25
"""Ends of the range, as parts of the estimate: experiments of one study differ by so much in their pace."""


class Pace:
    """The pace of a study and of each of its experiments, on the clock of the watcher.

    All progress since the start counts alike, so that the range settles. The service's `seconds_left` is of one moment:
    it doubles whenever one of two repetitions begins.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._started: dict[str, tuple[float, float]] = {}

    def left(self, watched: ExperimentRead | StudyRead) -> str | None:
        """Return the range of the time left, like "2 to 4 min"; None while it is not known, and once it has ended."""
        if watched.state is not State.RUNNING:
            self._started.pop(watched.id, None)
            return None
        now, done = self._clock(), display.fraction(watched.progress)
        if not done:
            self._started[watched.id] = (now, done)
        started_at, before = self._started.setdefault(watched.id, (now, done))
        if now - started_at < KNOWN_AFTER_S or done - before < KNOWN_FROM:
            return None
        return span((now - started_at) * (1 - done) / (done - before))


def span(seconds: float) -> str:
    """Return the range around an estimate, in minutes, or in hours if it is long."""
    unit, name = (3600, "h") if seconds > 2 * 3600 else (60, "min")
    low, high = math.floor(LOW * seconds / unit), math.ceil(HIGH * seconds / unit)
    return f"{low} to {high} {name}" if low else f"less than {high} {name}"
