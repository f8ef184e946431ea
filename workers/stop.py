"""A request to stop that a signal may make at any moment."""

from time import monotonic, sleep

LOOK_S = 0.1
"""Longest time until a request to stop is noticed."""


class Stop:
    """A flag without a lock, unlike an Event: a signal that arrives while an Event is being set waits for itself."""

    def __init__(self) -> None:
        self._set = False

    def set(self) -> None:
        """Request a stop; again is harmless."""
        self._set = True

    def is_set(self) -> bool:
        """Return whether a stop was requested."""
        return self._set

    def wait(self, seconds: float) -> None:
        """Wait, but not longer than until a stop is requested."""
        until = monotonic() + seconds
        while not self._set and (left := until - monotonic()) > 0:
            sleep(min(LOOK_S, left))
