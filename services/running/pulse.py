"""The pipe from a supervisor to the process that restarts it: heartbeats, its name, and why it ends.

It works while the database is away, so that a supervisor that waits for the database is told from one that hangs.
"""

import os
from contextlib import suppress
from time import monotonic
from typing import Self

VARIABLE = "GAPLAB_PULSE"
"""Environment variable with the number of the inherited end of the pipe; not a setting."""

EVERY_S = 0.5
"""Shortest interval between two heartbeats."""

_BEAT, _OWNER, _REASON = ".", "o", "r"


class PulsePipe:
    """The supervisor's end of the pipe; without a parent that listens it does nothing.

    Args:
        descriptor: to write to; None without such a parent.

    Attributes:
        trouble: why nothing runs although this supervisor lives; sent with each heartbeat.
    """

    trouble = ""

    def __init__(self, descriptor: int | None = None) -> None:
        self._descriptor = descriptor
        self._beaten = -EVERY_S

    @classmethod
    def inherited(cls) -> Self:
        """Return the end that the parent handed down; processes that this one starts do not inherit it."""
        if not (number := os.environ.pop(VARIABLE, "")):
            return cls()
        os.set_inheritable(int(number), False)
        os.set_blocking(int(number), False)
        return cls(int(number))

    def beat(self) -> None:
        """Send a heartbeat."""
        if monotonic() - self._beaten >= EVERY_S:
            self._beaten = monotonic()
            self._write(_BEAT + self.trouble)

    def name(self, owner: str) -> None:
        """Tell the name of this supervisor in the database."""
        self._write(_OWNER + owner)

    def explain(self, reason: str) -> None:
        """Tell why this supervisor ends."""
        self._write(_REASON + reason)

    def _write(self, line: str) -> None:
        if self._descriptor is not None:
            with suppress(OSError):  # the parent is gone, or stands still with a full pipe
                os.write(self._descriptor, f"{' '.join(line.split())[:500]}\n".encode())


class Heard:
    """The parent's end of the pipe: what it has heard of a supervisor.

    Attributes:
        owner: name of the supervisor in the database; None before it is told.
        reason: why the supervisor ends; None before it is told.
        begun: whether it has sent a heartbeat.
        trouble: why nothing runs; empty if all is well.
    """

    def __init__(self, descriptor: int) -> None:
        self.owner: str | None = None
        self.reason: str | None = None
        self.begun, self.trouble = False, ""
        self._descriptor = descriptor
        self._rest = b""
        self._latest = monotonic()
        os.set_blocking(descriptor, False)

    def silence_s(self) -> float:
        """Read what has come, and return the seconds since the latest line, or since the start."""
        with suppress(BlockingIOError):
            while received := os.read(self._descriptor, 65_536):
                self._latest = monotonic()
                *lines, self._rest = (self._rest + received).split(b"\n")
                for line in lines:
                    self._take(line.decode(errors="replace"))
        return monotonic() - self._latest

    def close(self) -> None:
        """Close the pipe."""
        os.close(self._descriptor)

    def _take(self, line: str) -> None:
        match line[:1]:
            case "o":
                self.owner = line[1:]
            case "r":
                self.reason = line[1:]
            case _:
                self.begun, self.trouble = True, line[1:]
