"""Permits to move hardware: short, renewed with each heartbeat, so that a holder that loses its lease stops in time."""

import os
from collections.abc import Callable
from contextlib import suppress
from threading import Event, Thread
from time import monotonic, sleep
from typing import TypeAlias

from gaplab.services.core.arrays import Genome
from gaplab.services.core.ports import Reality
from gaplab.services.core.types import Outcome

PERMIT_SHARE = 0.8
"""Part of a lease for which a permit holds: the hardware stops before others may take it."""

POLL_S = 0.25
"""Seconds between questions for a permit."""

Key: TypeAlias = tuple[int, int, int]
"""A repetition's id, the epoch of its lease, and the place in its log of the step whose measurement is permitted."""


class PermittedReality:
    """A Reality that moves hardware only with a permit; if the permit expires, it stops the hardware and its process.

    Args:
        reality: the hardware.
        stop: stops the hardware at once; called from another thread.
        left: returns the seconds until the permit of a step expires; raises TimeoutError if nobody answers.
        end: ends this process.
        poll_s: seconds between questions for a permit.
    """

    def __init__(
        self,
        reality: Reality,
        stop: Callable[[], None],
        left: Callable[[int], float],
        end: Callable[[], None] = lambda: os._exit(1),
        poll_s: float = POLL_S,
    ) -> None:
        self._reality, self._stop, self._left, self._end, self._poll_s = reality, stop, left, end, poll_s

    def __call__(self, genome: Genome, step: int = 0) -> Outcome:
        """Return the outcome of the genome `(g,)` in reality, once it is permitted to ask.

        If the permit expires, it neither returns nor raises: what a stopped robot gives is not a measurement.

        Args:
            genome: what to measure.
            step: place in the log of the step that it is measured for.
        """
        while (until := self._expiry(step, 0.0)) <= monotonic():
            sleep(self._poll_s)
        answered, expired = Event(), Event()
        Thread(target=self._watch, args=(answered, expired, step, until), name="permit", daemon=True).start()
        try:
            return self._reality(genome)
        finally:
            answered.set()
            if expired.is_set():
                Event().wait()  # for the end of the process

    def _expiry(self, step: int, known: float) -> float:
        """Return when the permit expires; the last known time, if the permits' process does not answer or has died."""
        asked = monotonic()
        with suppress(TimeoutError):
            return asked + self._left(step)
        return known

    def _watch(self, answered: Event, expired: Event, step: int, until: float) -> None:
        while not answered.wait(self._poll_s):
            until = self._expiry(step, until)
            if monotonic() > until and not answered.is_set():  # an answer ends its permit
                expired.set()
                with suppress(Exception):
                    self._stop()
                self._end()
                return
