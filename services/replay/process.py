"""Rollouts in a subprocess, so that a crash, a hang or a lack of memory does not affect the service.

It has no store: a spec is sent with the robot file that it needs.
"""

import logging
import os
import signal
from collections import OrderedDict
from collections.abc import Callable, Mapping
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from threading import Lock, Thread
from typing import Any, NamedTuple, TypeAlias, TypeVar

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.errors import EngineUnavailable, GaplabError
from gaplab.services.plugins import folders
from gaplab.services.plugins.external import named_files
from gaplab.services.plugins.folders import PluginDiffers
from gaplab.services.store.texts import brief
from gaplab.services.waiting_line import WaitingLine
from gaplab.services.world import robot_library

T = TypeVar("T")

LONGEST_S = 300.0
"""Time limit of one call, after which its process is killed. The first call of a process loads all libraries."""

NICENESS = 10
"""Replays and predictions yield the processor to the service."""

MOST_BYTES = 50_000_000
"""Memory for cached answers."""

MOST_OUTPUT = 10_000
"""Bytes of what a call prints that are logged: a plug-in may print without end."""

NONE: Mapping[str, str] = {}
"""No external plug-ins."""

Key: TypeAlias = tuple[str | int | None, ...]

log = logging.getLogger(__name__)


class EngineInterrupted(GaplabError):
    """The process that runs the physics ended before it answered."""

    kind, title = "engine-interrupted", "The simulation was interrupted"
    retry_after_s = 5


class AnswerCache:
    """A thread-safe cache of answers that never change; the least recently used make room for new ones."""

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._answers: OrderedDict[Key, tuple[Any, int]] = OrderedDict()
        self._most_bytes, self._bytes, self._lock = most_bytes, 0, Lock()

    def get(self, key: Key) -> Any:  # noqa: ANN401 - the type that was kept
        """Return the answer, or None if the cache does not have it."""
        with self._lock:
            if key not in self._answers:
                return None
            self._answers.move_to_end(key)
            return self._answers[key][0]

    def keep(self, key: Key, answer: Any, size_bytes: int) -> None:  # noqa: ANN401 - of any type
        """Add an answer, unless it alone is too large for the cache."""
        if size_bytes > self._most_bytes:
            return
        with self._lock:
            self._bytes += size_bytes - self._answers.pop(key, (None, 0))[1]
            self._answers[key] = (answer, size_bytes)
            while self._bytes > self._most_bytes:
                self._bytes -= self._answers.popitem(last=False)[1][1]


class RolloutProcess:
    """A subprocess that executes one call at a time, within a time limit; `answers` is a cache for the callers.

    It starts with the first call, and again after a crash or a timeout. It ends with its parent, even if that
    is killed: the parent's end of the pipe closes, and the next read fails. Other plug-ins get another one.
    """

    def __init__(self, longest_s: float = LONGEST_S, line: WaitingLine | None = None) -> None:
        self.answers = AnswerCache()
        self._longest_s = longest_s
        self._line = line or WaitingLine("replays and predictions")
        self._plugins: Mapping[str, str] = {}
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self._closed = False
        self._unlogged = 0

    @property
    def pid(self) -> int | None:
        """Process id; None if no process is running."""
        return self._process.pid if self._process else None

    def call(
        self,
        function: Callable[..., T],
        *arguments: Any,  # noqa: ANN401 - what the function takes
        load: Callable[[], Any] | None = None,
        plugins: Mapping[str, str] = NONE,
    ) -> T:
        """Return `function(*arguments)`, computed in the subprocess; all of it can be pickled.

        `load` returns the last argument once it is the caller's turn, as those who wait shall hold nothing large.
        `plugins` are the files, with their hashes, of the external plug-ins that it may import, by kind and name.

        Raises:
            EngineInterrupted: the process died or took too long, has other plug-ins, or `close` was called.
            EngineUnavailable: the library of an engine is not installed.
            LimitReached: too many callers wait, or earlier calls took too long.
            RuntimeError: the function raised another error; the message quotes it.
        """
        with self._line.turn():
            if plugins != self._plugins:
                self._discard()
                self._plugins = plugins
            return self._call(function, (*arguments, load()) if load else arguments)

    def close(self) -> None:
        """Kill the process, even in the middle of a call; later calls are refused."""
        self._closed = True
        if (process := self._process) is not None:
            process.kill()
        with self._line.lock:
            self._discard()

    def _discard(self) -> None:
        if self._process is not None and self._pipe is not None:
            self._pipe.close()
            self._process.kill()
            self._process.join()
        self._process = self._pipe = None

    def _call(self, function: Callable[..., T], arguments: tuple[Any, ...]) -> T:
        try:
            pipe = self._started()
            self._unlogged = MOST_OUTPUT
            pipe.send((function, arguments))
            if not pipe.poll(self._longest_s):
                raise TimeoutError
            succeeded, answer = pipe.recv()
        except (OSError, EOFError) as error:
            self._discard()
            late = isinstance(error, TimeoutError)
            what = f"took more than {self._longest_s:g} s in" if late else "ended"
            log.warning("%s %s the process for rollouts; the next call starts another", function.__name__, what)
            raise EngineInterrupted(f"the physics {what} its process; nothing else is affected") from error
        if succeeded:
            return answer  # type: ignore[no-any-return]
        kind, text = answer
        known: Mapping[str, type[GaplabError]] = {
            EngineUnavailable.__name__: EngineUnavailable,
            PluginDiffers.__name__: EngineInterrupted,
        }
        raise known[kind](text) if kind in known else RuntimeError(f"{kind}: {text}")

    def _started(self) -> Connection:
        if self._closed:
            raise EngineInterrupted("the service is shutting down and computes no more replays or predictions")
        if self._process is not None and (self._pipe is None or self._pipe.poll() or not self._process.is_alive()):
            self._discard()  # an idle process says nothing: its end of the pipe is closed
        if self._pipe is None:
            context = get_context("spawn")
            ours, theirs = context.Pipe()
            printed, output = context.Pipe(duplex=False)
            process = context.Process(target=_serve, args=(theirs, output, self._plugins), name="rollouts", daemon=True)
            process.start()  # if this raises, the next call tries again
            theirs.close()
            output.close()
            Thread(target=self._log_output, args=(printed,), name="output of rollouts", daemon=True).start()
            self._process, self._pipe = process, ours
        return self._pipe

    def _log_output(self, printed: Connection) -> None:
        """Log the beginning of what each call prints, until the process ends."""
        with printed:
            while part := os.read(printed.fileno(), 2**16):
                kept, self._unlogged = part[: self._unlogged], max(0, self._unlogged - len(part))
                if kept:
                    rest = "" if self._unlogged else " (no more of this call is logged)"
                    log.info("printed by a rollout: %s%s", kept.decode(errors="replace"), rest)


def _serve(pipe: Connection, output: Connection, plugins: Mapping[str, str]) -> None:
    """Execute calls until the other end of the pipe closes, and write what they print to `output`."""
    for descriptor in (1, 2):
        os.dup2(output.fileno(), descriptor)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which closes the pipe
    os.nice(NICENESS)
    with suppress(EOFError, OSError):
        while True:
            function, arguments = pipe.recv()
            try:
                folders.use(plugins)
                answer = (True, function(*arguments))
            except Exception as error:  # noqa: BLE001 - the caller raises it
                answer = (False, (type(error).__name__, brief(str(error))))
            print(end="", flush=True)  # noqa: T201 - what the call printed
            pipe.send(answer)


class SentSpec(NamedTuple):
    """A resolved spec as JSON, with the texts of robot files and the files of external plug-ins that it needs."""

    text: str
    robots: tuple[str, ...]
    plugins: dict[str, str]


def sent(spec: ResolvedSpec) -> SentSpec:
    """Return a spec to be sent."""
    plugins = named_files(spec.model_dump(mode="json"))
    return SentSpec(spec.model_dump_json(), robot_library.needed_by(spec.model_dump(mode="json")), plugins)


def received(spec: SentSpec) -> ResolvedSpec:
    """Return the spec that was sent, and let this process know its robot.

    The process must have imported the spec's plug-ins and no others.
    """
    robot_library.learn(spec.robots)
    return ResolvedSpec.model_validate_json(spec.text)
