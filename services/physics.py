"""Physics in a process of its own: what it takes or breaks there is not the caller's."""

import logging
import os
import signal
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from threading import Lock
from typing import Any, TypeVar

from services.core.errors import EngineInterrupted, EngineUnavailable, LimitReached

T = TypeVar("T")

LONGEST_S = 60.0
"""One question may take so long; the process that takes longer is ended."""

QUEUE_S = 20.0
"""A question waits so long for those before it."""

NICENESS = 10
"""Whoever asks for pictures does not slow down those who serve."""

log = logging.getLogger(__name__)


class Physics:
    """Answers one question at a time in one process: started at its first, started anew if it dies or takes too long.

    The process ends with this one, however that ends: its end of the pipe closes, and there is nothing left to do.

    Args:
        longest_s: that one question may take.
        queue_s: that a question waits for those before it.
    """

    def __init__(self, longest_s: float = LONGEST_S, queue_s: float = QUEUE_S) -> None:
        self._longest_s, self._queue_s = longest_s, queue_s
        self._lock = Lock()
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None

    @property
    def pid(self) -> int | None:
        """Of the process; None while there is none."""
        return self._process.pid if self._process else None

    def ask(self, function: Callable[..., T], *arguments: Any) -> T:  # noqa: ANN401 - whatever the function takes
        """What the function of a module returns for the arguments, in the process.

        Raises:
            EngineInterrupted: the process died of it, or it took too long.
            EngineUnavailable: the library of an engine is not installed.
            LimitReached: others were asking for too long.
            RuntimeError: the function raised anything else; the message has what.
        """
        if not self._lock.acquire(timeout=self._queue_s):
            msg = f"other replays and predictions have been computed for {self._queue_s:g} s; try again soon"
            raise LimitReached(msg, retry_after_s=5)
        try:
            return self._answer(function, arguments)
        finally:
            self._lock.release()

    def close(self) -> None:
        """End the process; the next question would start another."""
        if self._process is not None and self._pipe is not None:
            self._pipe.close()
            self._process.kill()
            self._process.join()
            self._process.close()
        self._process = self._pipe = None

    def _answer(self, function: Callable[..., T], arguments: tuple[Any, ...]) -> T:
        pipe = self._started()
        try:
            pipe.send((function, arguments))
            if not pipe.poll(self._longest_s):
                raise TimeoutError
            good, answer = pipe.recv()
        except (OSError, EOFError) as error:
            self.close()
            what = f"took more than {self._longest_s:g} s" if isinstance(error, TimeoutError) else "ended the process"
            log.warning("physics was started anew: %s %s", function.__name__, what)
            msg = f"the physics {what} that computes it; nothing else was harmed"
            raise EngineInterrupted(msg) from error
        if good:
            return answer  # type: ignore[no-any-return]
        kind, text = answer
        raise EngineUnavailable(text) if kind == EngineUnavailable.__name__ else RuntimeError(f"{kind}: {text}")

    def _started(self) -> Connection:
        if self._process is not None and not self._process.is_alive():
            self.close()
        if self._pipe is None:
            context = get_context("spawn")
            self._pipe, theirs = context.Pipe()
            self._process = context.Process(target=_serve, args=(theirs,), name="physics", daemon=True)
            self._process.start()
            theirs.close()
        return self._pipe


def _serve(pipe: Connection) -> None:
    """Answer until the other end of the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, whose end is ours
    os.nice(NICENESS)
    while True:
        try:
            function, arguments = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            answer = (True, function(*arguments))
        except Exception as error:  # noqa: BLE001 - whatever it is, it is the asker's to see
            answer = (False, (type(error).__name__, str(error)))
        try:
            pipe.send(answer)
        except OSError:
            return
