"""Tasks in processes of this machine, without Ray: a process computes one repetition after the other, on one core.

A process is a new Python that imports gaplab alone: not the program that started it, which needs no `if __name__ ==
"__main__"`. It ends when that program does, and Ctrl-C in a terminal does not reach it.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from time import monotonic
from typing import Any, Self, TypeVar

from gaplab.services.core.errors import PluginBroken
from gaplab.services.plugins.folders import PluginDiffers
from gaplab.services.specs.blame import describe
from gaplab.services.specs.resolution import hardware_of
from gaplab.services.store.lease import Claim
from gaplab.workers.errors import ClusterUnusable, TaskLost
from gaplab.workers.expected import Versions, check_here, plugins_of, versions
from gaplab.workers.permits import Key
from gaplab.workers.task import Batch, delivered, give_back_memory, prepared

T = TypeVar("T")


@dataclass(frozen=True)
class Work:
    """A claimed repetition to compute; see `Tasks.start`."""

    claim: Claim
    expected: Versions
    checkpoint_s: float


@dataclass(frozen=True)
class Permits:
    """Measurements that may move hardware until a time of the monotonic clock."""

    keys: Sequence[Key] = ()
    until: float = 0.0


class Process:
    """A process that computes repetitions with one set of plug-ins; what it prints is lost, but for errors."""

    def __init__(self, plugins: str) -> None:
        self.plugins, self.idle = plugins, True
        self.connection, theirs = Pipe()
        with theirs:
            descriptor = theirs.fileno()
            program = f"from gaplab.workers.process_tasks import main; main({descriptor})"
            self._process = subprocess.Popen(  # noqa: S603 - our own module
                [sys.executable, "-c", program],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                pass_fds=[descriptor],
                start_new_session=True,
            )

    def receive(self) -> Any:  # noqa: ANN401 - what it sends
        """Return what it sends next; raise TaskLost if it has ended."""
        try:
            return self.connection.recv()
        except (EOFError, OSError) as error:
            raise TaskLost(f"the worker was lost: it ended with code {self.end()}") from error

    def end(self) -> int:
        """End it at once, and return its exit code."""
        self.idle = False
        self._process.kill()
        self.connection.close()
        return self._process.wait()


class ProcessTask:
    """A repetition in a process; see `Task`."""

    def __init__(self, process: Process, work: Work) -> None:
        self.process, self._lease, self._permitted = process, (work.claim.id, work.claim.epoch), False
        process.idle = False
        process.connection.send(work)

    def take(self) -> Batch | None:
        """Return the next batch, or None at the end; see `Task`."""
        answer: Batch | PluginDiffers | ClusterUnusable | None = self.process.receive()
        if isinstance(answer, tuple):
            return answer
        self.process.idle = True
        if answer is not None:
            raise answer
        return None

    def cancel(self) -> None:
        """End the process at once."""
        self.process.end()

    def permit(self, keys: Sequence[Key], until: float) -> None:
        """Permit its measurements among these, or end its permit; a process without a permit is not told that."""
        ours = [key for key in keys if key[:2] == self._lease]
        if ours or self._permitted:
            with suppress(OSError):  # it has ended
                self.process.connection.send(Permits(ours, until))
        self._permitted = bool(ours)


class ProcessTasks:
    """The tasks of one supervisor in processes of this machine; see `Tasks`. They end with the context."""

    def __init__(self) -> None:
        self.versions = versions()
        self._processes: list[Process] = []
        self._moving: list[ProcessTask] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._processes:
            process.end()

    def start(self, claim: Claim, expected: Versions, checkpoint_s: float) -> ProcessTask:
        """Give a claimed repetition to an idle process, or else to a new one."""
        plugins = plugins_of(expected)
        process = next((each for each in self._processes if each.idle and each.plugins == plugins), None)
        if process is None:
            process = Process(plugins)
            self._processes.append(process)
        task = ProcessTask(process, Work(claim, expected, checkpoint_s))
        if hardware_of(claim.spec) is not None:
            self._moving.append(task)
        return task

    def ready(self, tasks: Sequence[ProcessTask], longest_s: float) -> list[ProcessTask]:
        """Return the tasks that have something; see `Tasks`."""
        ready = wait([task.process.connection for task in tasks], longest_s)
        return [task for task in tasks if task.process.connection in ready]

    def permit(self, keys: Sequence[Key], until: float) -> None:
        """Permit these measurements and no others; see `Tasks`."""
        self._moving = [task for task in self._moving if not task.process.idle]
        for task in self._moving:
            task.permit(keys, until)

    def checks(self, *_: object) -> "NoChecks":
        """Leave the sensitivity checks to a service."""
        return NoChecks()


class NoChecks:
    """Sensitivity checks that stay in the queue; see `Checks`."""

    def step(self) -> None:
        """None runs."""

    def heartbeat(self) -> None:
        """None is held."""

    def hand_back(self) -> None:
        """None was taken."""


def computed(calls: Sequence[Callable[[], T]], processes: int) -> Iterator[tuple[int, T]]:
    """Yield number and result of each call as it ends, in so many processes, or in this one; all can be pickled.

    Raises:
        PluginBroken: a call in another process raised an error.
        TaskLost: a process has ended.
    """
    left, running = enumerate(calls), dict[Any, tuple[Process, int]]()
    if processes == 1:
        yield from ((number, call()) for number, call in left)
        return
    with ExitStack() as ends:
        idle = [Process("") for _ in range(min(processes, len(calls)))]
        for process in idle:
            ends.callback(process.end)
        while True:
            for process, (number, call) in zip(idle, left, strict=False):
                process.connection.send(call)
                running[process.connection] = process, number
            if not running:
                return
            pairs = [running.pop(connection) for connection in wait([*running])]
            idle = [process for process, _ in pairs]
            yield from ((number, _received(process)) for process, number in pairs)


def _received(process: Process) -> Any:  # noqa: ANN401 - what the call returns
    if isinstance(result := process.receive(), PluginBroken):
        raise result
    return result


def _answered(call: Callable[[], Any]) -> Any:  # noqa: ANN401 - what it returns
    try:
        return call()
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a plug-in may raise anything
        return PluginBroken(describe(error))


def main(descriptor: int) -> None:
    """Compute what arrives over the connection, until it closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    connection = Connection(descriptor)
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            work = connection.recv()
            if isinstance(work, Work):
                _compute(connection, work)
            elif callable(work):
                connection.send(_answered(work))
    os._exit(0)  # at once: a rollout in another thread would find its libraries unloaded


def _compute(connection: "Connection[Any, Any]", work: Work) -> None:
    claim, permits = work.claim, Permits()

    def left(step: int) -> float:
        nonlocal permits
        try:
            while connection.poll():
                permits = connection.recv()
        except (EOFError, OSError):  # whoever permits it is gone
            return 0.0
        return permits.until - monotonic() if (claim.id, claim.epoch, step) in permits.keys else 0.0

    try:
        check_here(work.expected)
    except (ClusterUnusable, PluginDiffers) as error:
        connection.send(error)
        return
    connection.send(())
    permitted = left if hardware_of(claim.spec) is not None else None
    for batch in delivered(lambda: prepared(claim, permitted), claim, work.checkpoint_s):
        connection.send(batch)
    give_back_memory()
    connection.send(None)
