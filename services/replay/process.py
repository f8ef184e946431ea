"""Physics in a process of its own: what it takes or breaks there is not the caller's."""

import logging
import os
import signal
from collections import OrderedDict
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from threading import Lock
from typing import Any, TypeAlias, TypeVar

from gaplab.services.core.errors import EngineInterrupted, EngineUnavailable, LimitReached

T = TypeVar("T")

LONGEST_S = 120.0
"""One question may take so long; the process that takes longer is ended. The first one loads all libraries."""

QUEUE_S = 20.0
"""A question waits so long for those before it."""

NICENESS = 10
"""Whoever asks for pictures does not slow down those who serve."""

MOST_BYTES = 50_000_000
"""Of answers that are remembered."""

Key: TypeAlias = tuple[str | int | None, ...]

log = logging.getLogger(__name__)


class Memory:
    """Answers that never change, the longest unused forgotten first.

    Args:
        most_bytes: that they may take together.
    """

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._most, self._taken = most_bytes, 0
        self._lock = Lock()
        self._found: OrderedDict[Key, tuple[Any, int]] = OrderedDict()

    def get(self, key: Key) -> Any:  # noqa: ANN401 - whatever was kept
        """What was kept under the key; None if nothing is."""
        with self._lock:
            if key not in self._found:
                return None
            self._found.move_to_end(key)
            return self._found[key][0]

    def keep(self, key: Key, answer: Any, weight: int) -> None:  # noqa: ANN401 - whatever it is
        """Remember an answer that takes so many bytes."""
        with self._lock:
            self._taken += weight - self._found.pop(key, (None, 0))[1]
            self._found[key] = (answer, weight)
            while self._taken > self._most:
                self._taken -= self._found.popitem(last=False)[1][1]


class Physics:
    """Answers one question at a time in one process: started at its first, started anew if it dies or takes too long.

    The process ends with this one, however that ends: its end of the pipe closes, and there is nothing left to do.

    Args:
        longest_s: that one question may take.
        queue_s: that a question waits for those before it.

    Attributes:
        memory: of answers, for those who ask.
    """

    def __init__(self, longest_s: float = LONGEST_S, queue_s: float = QUEUE_S) -> None:
        self.memory = Memory()
        self._longest_s, self._queue_s = longest_s, queue_s
        self._lock = Lock()
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self._closed = False

    @property
    def pid(self) -> int | None:
        """Of the process; None while there is none."""
        return self._process.pid if self._process else None

    def ask(self, function: Callable[..., T], *arguments: Any) -> T:  # noqa: ANN401 - whatever the function takes
        """What the function of a module returns for the arguments, in the process.

        Raises:
            EngineInterrupted: the process died of it, or it took too long, or everything is closed.
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
        """End the process, whatever it is at; questions are refused from now on."""
        self._closed = True
        if (process := self._process) is not None:
            process.kill()
        with self._lock:
            self._discard()

    def _discard(self) -> None:
        if self._process is not None and self._pipe is not None:
            self._pipe.close()
            self._process.kill()
            self._process.join()
        self._process = self._pipe = None

    def _answer(self, function: Callable[..., T], arguments: tuple[Any, ...]) -> T:
        try:
            pipe = self._started()
            pipe.send((function, arguments))
            if not pipe.poll(self._longest_s):
                raise TimeoutError
            good, answer = pipe.recv()
        except (OSError, EOFError) as error:
            self._discard()
            late = isinstance(error, TimeoutError)
            what = f"took more than {self._longest_s:g} s in the process" if late else "ended the process"
            log.warning("%s %s of physics; the next question starts another", function.__name__, what)
            msg = f"computing it {what} of physics; nothing else was harmed"
            raise EngineInterrupted(msg) from error
        if good:
            return answer  # type: ignore[no-any-return]
        kind, text = answer
        raise EngineUnavailable(text) if kind == EngineUnavailable.__name__ else RuntimeError(f"{kind}: {text}")

    def _started(self) -> Connection:
        if self._closed:
            msg = "the service ends; nothing is computed any more"
            raise EngineInterrupted(msg)
        if self._process is not None and not self._process.is_alive():
            self._discard()
        if self._pipe is None:
            context = get_context("spawn")
            ours, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(theirs,), name="physics", daemon=True)
            process.start()  # or raise: then there is none, and the next question starts one
            theirs.close()
            self._process, self._pipe = process, ours
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
