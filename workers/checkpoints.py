"""Repetitions that deliver steps, checkpoints of the running step, and heartbeats."""

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from queue import Empty, SimpleQueue
from threading import Event, Thread
from time import perf_counter, sleep
from typing import Any, TypeAlias

import numpy as np

from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.answers import Answer, Answers, pack
from gaplab.services.core.arrays import Genome
from gaplab.services.core.errors import TryAgain
from gaplab.services.core.loop import Setting, repetition
from gaplab.services.core.ports import RealityAwaited
from gaplab.services.core.types import Outcome, Selected, Step, Tuned, next_place
from gaplab.services.specs.assembly import RealityFailed
from gaplab.services.store.lease import Checkpoint, Delivered, Pulse, Requested, TimedStep
from gaplab.workers.permits import PermittedReality

CHECKPOINT_S = 10.0
"""Seconds between the checkpoints of a step; shorter steps have none.

It limits the work that a crash loses, and the time that a repetition needs to stop."""

CALLS_PER_CHECKPOINT = 4
"""Least number of calls between two checkpoints; longer calls are split."""

PULSE_S = 5.0
"""Seconds without a delivery after which a worker sends a heartbeat."""

PAUSES_S = (1.0, 10.0, 60.0)
"""Pauses before each repetition of a step whose error may pass; after the last, the error counts."""

PASSING = (TryAgain, ConnectionError, TimeoutError, BlockingIOError, InterruptedError, MemoryError)
"""Errors that may pass by themselves."""

log = logging.getLogger("gaplab.worker")

Emit: TypeAlias = Callable[[Delivered | Pulse], None]

_Item: TypeAlias = Delivered | Pulse | BaseException | None
"""What the computation hands over: a delivery, a heartbeat, the error that ended it, or None at its end."""


def recorded(
    setting: Setting,
    log: Sequence[Step],
    checkpoints: Sequence[Checkpoint],
    every_s: float = CHECKPOINT_S,
) -> Iterator[Delivered | Pulse]:
    """Yield the steps that follow the log, checkpoints of long steps as soon as they exist, and heartbeats.

    The given checkpoints are those of the next step; further ones are `every_s` seconds apart. A thread computes,
    because checkpoints arise deep inside a step, where nothing can yield, and heartbeats while it computes.

    Raises:
        BaseException: whatever the computation raises, SystemExit too.
    """
    items: SimpleQueue[_Item] = SimpleQueue()
    unwanted = Event()

    def emit(item: Delivered | Pulse) -> None:
        if unwanted.is_set():
            raise _Unwanted
        items.put(item)

    def compute() -> None:
        try:
            recorder.run(setting)
            items.put(None)
        except BaseException as error:  # noqa: BLE001 - SystemExit too, which would end a thread silently
            items.put(error)

    recorder = StepRecorder(emit, every_s, log, checkpoints)
    Thread(target=compute, name="repetition", daemon=True).start()
    try:
        while (item := _next(items, recorder)) is not None:
            if isinstance(item, BaseException):
                raise item
            yield item
    finally:
        unwanted.set()


class StepRecorder:
    """Records the answers of the step under way, and emits a checkpoint of them every few seconds.

    The log ends before the running step; its checkpoints are from before an interruption.
    """

    def __init__(self, emit: Emit, every_s: float, log: Sequence[Step], checkpoints: Sequence[Checkpoint] = ()) -> None:
        self._emit = emit
        self._every_s = every_s
        self._log = list(log)
        self._parts = list(checkpoints)
        self._before_s = sum(checkpoint.seconds for checkpoint in checkpoints)
        self._begun = self._last = self._called = self._progressed = perf_counter()
        self._answers: list[Answer] = []
        self._rollouts, self._rollout_s = 0, 0.0
        self._measuring = False

    def run(self, setting: Setting) -> None:
        """Compute the repetition to its end; repeat a step after a pause if its error may pass."""
        watched = replace(setting, reality=lambda genome: self._measured(setting, genome))
        tries, steps = 0, len(self._log)
        while True:
            try:
                for step in repetition(watched, tuple(self._log), lambda: self.answers(watched)):
                    self.end(step)
            except RealityAwaited as awaited:
                self._emit(self.request(setting, awaited.genome))
                return
            except Exception as error:
                tries = tries + 1 if len(self._log) == steps else 1
                steps = len(self._log)
                if not may_pass(error) or tries > len(PAUSES_S):
                    raise
                self._answers, self._rollouts, self._progressed = [], 0, perf_counter() + PAUSES_S[tries - 1]
                sleep(PAUSES_S[tries - 1])
            else:
                return

    def answers(self, setting: Setting) -> Answers:
        """Return the answers of the step under way: those of its checkpoints, then new ones, which are recorded."""
        checkpoints = (checkpoint.answers for checkpoint in tuple(self._parts))
        return Answers(setting.simulate, setting.batch_size, checkpoints, self, setting.sense, setting.reading_periods)

    def genomes_per_call(self, simulators: int) -> int:
        """Return the number of genomes of a call that is short enough; 1 while durations are unknown."""
        self._called = perf_counter()
        if not self._rollout_s:
            return 1
        return max(1, int(self._every_s / CALLS_PER_CHECKPOINT / (self._rollout_s * simulators)))

    def record(self, answers: Sequence[Answer], rollouts: int, budget: int) -> None:
        """Keep the answers of a call that has just ended, and emit a checkpoint if it is time."""
        self._progressed = now = perf_counter()
        self._rollout_s = (now - self._called) / rollouts
        self._answers += answers
        self._rollouts += rollouts
        if now - self._last >= self._every_s:
            self._checkpoint(now, budget)

    def end(self, step: Step) -> None:
        """Emit the completed step, and begin the next."""
        now = perf_counter()
        self._emit(TimedStep(step, self._before_s + now - self._begun))
        self._log.append(step)
        self._before_s, self._begun, self._last, self._progressed = 0.0, now, now, now
        self._parts, self._answers, self._rollouts = [], [], 0

    def request(self, setting: Setting, genome: Genome) -> Requested:
        """Return the request for the measurement that the log needs next, with its safety forecast."""
        last = self._log[-1]
        kind = MeasurementKind.SAMPLE if isinstance(last, Selected) else MeasurementKind.PROBE
        return Requested(next_place(self._log), last.iteration, kind, genome, self._forecast(setting, genome))

    def _forecast(self, setting: Setting, genome: Genome) -> dict[str, Any] | None:
        """Return the forecast of the latest simulators for a genome, as JSON; None if there is none."""
        believed = next((step.simulators for step in reversed(self._log) if isinstance(step, Tuned)), ())
        if setting.forecast is None or not believed:
            return None
        parameters = np.array([simulator.parameters for simulator in believed])
        try:
            return setting.forecast(genome, parameters, self._progress).model_dump(mode="json")
        except Exception:  # a measurement is never held up by its forecast
            log.exception("the safety forecast failed")
            return None

    def _progress(self) -> None:
        self._progressed = perf_counter()

    def pulse(self) -> Pulse:
        """Return a heartbeat."""
        now = perf_counter()
        step_s = self._before_s + now - self._begun
        return Pulse(next_place(self._log), self._measuring, max(0.0, now - self._progressed), step_s)

    def _measured(self, setting: Setting, genome: Genome) -> Outcome:
        self._measuring, self._progressed = True, perf_counter()
        try:
            if isinstance(setting.reality, PermittedReality):
                self._emit(self.pulse())  # it waits for a permit, which is given once the beginning is stored
                return setting.reality(genome, next_place(self._log))
            return setting.reality(genome)
        finally:
            self._measuring = False

    def _checkpoint(self, now: float, budget: int) -> None:
        rollouts = min(budget, self._rollouts + (self._parts[-1].rollouts if self._parts else 0))  # some are not needed
        place, seconds = (next_place(self._log), len(self._parts)), now - self._last
        checkpoint = Checkpoint(*place, pack(self._answers), seconds, rollouts, budget)
        self._emit(checkpoint)
        self._parts.append(checkpoint)
        self._last, self._answers, self._rollouts = now, [], 0


def may_pass(error: BaseException) -> bool:
    """Return whether the error, or reality's error behind it, may pass by itself."""
    return isinstance(error.__cause__ if isinstance(error, RealityFailed) else error, PASSING)


class _Unwanted(Exception):
    """The consumer has closed the iterator, and takes no further items."""


def _next(items: SimpleQueue[_Item], recorder: StepRecorder) -> _Item:
    """Return the next item, or a heartbeat if none comes for a while."""
    try:
        return items.get(timeout=PULSE_S)
    except Empty:
        return recorder.pulse()
