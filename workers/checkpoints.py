"""Repetitions that deliver checkpoints of a running step."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from queue import SimpleQueue
from threading import Event, Thread
from time import perf_counter

from gaplab.services.core.answers import Answer, Answers, pack
from gaplab.services.core.loop import Setting, repetition
from gaplab.services.core.types import Step
from gaplab.services.running.execution import Checkpoint, Delivered, TimedStep

CHECKPOINT_S = 10.0
"""Seconds between the checkpoints of a step; shorter steps have none.

It limits the work that a crash loses, and the time that a repetition needs to stop."""

SHARE = 4
"""Number of calls between two checkpoints, at least; longer calls are split."""

Emit = Callable[[Delivered], None]


def recorded(
    setting: Setting, log: Sequence[Step], checkpoints: Sequence[Checkpoint], every_s: float = CHECKPOINT_S
) -> Iterator[Delivered]:
    """Yield the steps that follow the log, and checkpoints of long steps, as soon as they exist.

    Args:
        setting: setting of the repetition.
        log: its steps so far.
        checkpoints: checkpoints of the next step.
        every_s: seconds between checkpoints of a step.
    """

    def compute(emit: Emit) -> None:
        recorder = StepRecorder(emit, every_s, len(log), checkpoints)
        for step in repetition(setting, log, partial(recorder.answers, setting)):
            recorder.end(step)

    return _in_a_thread(compute)


class StepRecorder:
    """Records the answers of the step under way, and emits a checkpoint of them from time to time.

    Args:
        emit: takes steps and checkpoints.
        every_s: seconds between checkpoints.
        step: the place in the log of the step under way.
        checkpoints: its checkpoints from before an interruption.
    """

    def __init__(self, emit: Emit, every_s: float, step: int, checkpoints: Sequence[Checkpoint] = ()) -> None:
        self._emit = emit
        self._every_s = every_s
        self._step, self._part = step, len(checkpoints)
        self._before = checkpoints
        self._before_s = sum(checkpoint.seconds for checkpoint in checkpoints)
        self._begun = self._last = self._called = perf_counter()
        self._answers: list[Answer] = []
        self._rollout_s = 0.0

    def answers(self, setting: Setting) -> Answers:
        """Return the answers of the step under way: those of its checkpoints, then new ones, which are recorded."""
        checkpoints = (checkpoint.answers for checkpoint in self._before)
        return Answers(setting.simulate, setting.batch_size, checkpoints, self)

    def genomes_per_call(self, simulators: int) -> int:
        """Return the number of genomes of a call that is short enough; 1 while durations are unknown."""
        self._called = perf_counter()
        if not self._rollout_s:
            return 1
        return max(1, int(self._every_s / SHARE / (self._rollout_s * simulators)))

    def record(self, answers: Sequence[Answer]) -> None:
        """Keep the answers of a call that has just ended, and emit a checkpoint if it is time."""
        now = perf_counter()
        self._rollout_s = (now - self._called) / sum(len(fitnesses) for _, fitnesses in answers)
        self._answers += answers
        if now - self._last >= self._every_s:
            self._checkpoint(now)

    def end(self, step: Step) -> None:
        """Emit the completed step, and begin the next."""
        now = perf_counter()
        self._emit(TimedStep(step, self._before_s + now - self._begun))
        self._step, self._part, self._before = self._step + 1, 0, ()
        self._before_s, self._begun, self._last = 0.0, now, now
        self._answers = []

    def _checkpoint(self, now: float) -> None:
        self._emit(Checkpoint(self._step, self._part, pack(self._answers), now - self._last))
        self._part, self._last, self._answers = self._part + 1, now, []


class _Unwanted(Exception):
    """The consumer has closed the iterator, and takes no further items."""


def _in_a_thread(compute: Callable[[Emit], None]) -> Iterator[Delivered]:
    """Yield the items that `compute` emits in a thread, even from deep inside a step, where nothing can yield.

    Once the iterator is closed, the thread ends at the next item that it emits.
    """
    items: SimpleQueue[Delivered | None] = SimpleQueue()
    raised: list[BaseException] = []
    unwanted = Event()

    def emit(item: Delivered) -> None:
        if unwanted.is_set():
            raise _Unwanted
        items.put(item)

    def run() -> None:
        try:
            compute(emit)
        except _Unwanted:
            return
        except Exception as error:  # noqa: BLE001 - it is raised again below, where the items are taken
            raised.append(error)
        items.put(None)

    Thread(target=run, name="repetition", daemon=True).start()
    try:
        while (item := items.get()) is not None:
            yield item
    finally:
        unwanted.set()
    if raised:
        raise raised[0]
