"""A repetition that tells how far it has got while a step is under way."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from queue import SimpleQueue
from threading import Event, Thread
from time import perf_counter

import numpy as np

from gaplab.services.core.arrays import Fitnesses, Genomes, Parameters
from gaplab.services.core.loop import Setting, repetition
from gaplab.services.core.ports import Simulate
from gaplab.services.core.recall import Answer, Recall, pack
from gaplab.services.core.types import Step
from gaplab.services.running.execution import Checkpoint, Delivered, TimedStep

CHECKPOINT_S = 10.0
"""Between the checkpoints of a step; shorter ones have none. It bounds what a crash costs, and how long one waits for a
repetition that is told to stop."""

SHARE = 4
"""A call that would take longer than this part of the time between checkpoints is made in several."""

Emit = Callable[[Delivered], None]


def recorded(
    setting: Setting, log: Sequence[Step], checkpoints: Sequence[Checkpoint], every_s: float = CHECKPOINT_S
) -> Iterator[Delivered]:
    """The steps that follow the log, and checkpoints of those that take long, as they come about.

    Args:
        setting: of the repetition.
        log: its steps so far.
        checkpoints: of the step that comes next.
        every_s: between checkpoints of a step.
    """

    def compute(emit: Emit) -> None:
        recorder = Recorder(setting.simulate, emit, every_s, len(log), checkpoints)
        recall = Recall(recorder, setting.batch, (each.answers for each in checkpoints))
        for step in repetition(replace(setting, simulate=recall, batch=recall.batch), log):
            recorder.end(step)
            recall.forget()

    return _aside(compute)


class Recorder:
    """A Simulate that keeps what it answered in the step under way, and emits it from time to time.

    Args:
        simulate: answers.
        emit: takes steps and checkpoints.
        every_s: between checkpoints.
        step: the place in the log of the step under way.
        checkpoints: of it, from before.
    """

    def __init__(
        self, simulate: Simulate, emit: Emit, every_s: float, step: int, checkpoints: Sequence[Checkpoint] = ()
    ) -> None:
        self._simulate = simulate
        self._emit = emit
        self._every_s = every_s
        self._step, self._part = step, len(checkpoints)
        self._before_s = sum(each.seconds for each in checkpoints)
        self._begun = self._last = perf_counter()
        self._answers: list[Answer] = []
        self._rollout_s = 0.0

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """`(n, g)` genomes × `(m, p)` parameters -> `(n, m)` fitnesses, as the Simulate that was given."""
        fitnesses: list[Fitnesses] = []
        done = 0
        while done < len(genomes):
            some = genomes[done : done + self._at_a_time(len(parameters), len(genomes))]
            fitnesses.append(self._ask(some, parameters))
            done += len(some)
        return fitnesses[0] if len(fitnesses) == 1 else np.concatenate(fitnesses)

    def end(self, step: Step) -> None:
        """The step is there: emit it, and begin the next."""
        now = perf_counter()
        self._emit(TimedStep(step, self._before_s + now - self._begun))
        self._step, self._part = self._step + 1, 0
        self._before_s, self._begun, self._last = 0.0, now, now
        self._answers = []

    def _at_a_time(self, simulators: int, genomes: int) -> int:
        """Genomes to ask for in one call; one, to learn how long it takes, if nothing is known."""
        if not self._rollout_s:
            return 1
        return max(1, min(genomes, int(self._every_s / SHARE / (self._rollout_s * simulators))))

    def _ask(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        begun = perf_counter()
        fitnesses = self._simulate(genomes, parameters)
        now = perf_counter()
        self._rollout_s = (now - begun) / fitnesses.size
        self._answers.append((genomes, parameters, fitnesses))
        if now - self._last >= self._every_s:
            self._checkpoint(now)
        return fitnesses

    def _checkpoint(self, now: float) -> None:
        self._emit(Checkpoint(self._step, self._part, pack(self._answers), now - self._last))
        self._part, self._last, self._answers = self._part + 1, now, []


class _Unwanted(Exception):
    """Nobody takes what is emitted any more."""


def _aside(compute: Callable[[Emit], None]) -> Iterator[Delivered]:
    """What is emitted in a thread of its own: a checkpoint comes from the depths of a step, where nothing can yield.

    The thread ends at the next thing that it emits if nobody wants it any more.
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
        except Exception as error:  # noqa: BLE001 - it is raised again where the items are taken
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
