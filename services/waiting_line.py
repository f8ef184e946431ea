"""A waiting line in front of work that is done for one caller at a time.

A waiting caller holds a thread of the service, so that a line is short: beyond its length, a caller is refused at once.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import BoundedSemaphore, Lock

from gaplab.services.core.errors import LimitReached

LENGTH = 8
"""Callers that may wait in one line; the service has 40 threads."""

RETRY_AFTER_S = 5


class WaitingLine:
    """Callers that wait for their turn.

    Args:
        what: the work, in the plural, for messages.
        longest_s: time limit of the wait for a turn.
        length: callers that may wait.

    Attributes:
        lock: held by the caller whose turn it is.
    """

    def __init__(self, what: str, *, longest_s: float = 20.0, length: int = LENGTH) -> None:
        self.lock = Lock()
        self._what = what
        self._longest_s = longest_s
        self._length = length
        self._places = BoundedSemaphore(length + 1)

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Wait for the caller's turn, which lasts as long as the context.

        Raises:
            LimitReached: too many wait, or the wait was too long.
        """
        if not self._places.acquire(blocking=False):
            msg = f"{self._length} requests wait for {self._what} already; try again soon"
            raise LimitReached(msg, RETRY_AFTER_S)
        try:
            if not self.lock.acquire(timeout=self._longest_s):
                msg = f"other {self._what} have been computed for {self._longest_s:g} s; try again soon"
                raise LimitReached(msg, RETRY_AFTER_S)
            try:
                yield
            finally:
                self.lock.release()
        finally:
            self._places.release()
