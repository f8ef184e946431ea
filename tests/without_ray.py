"""The real supervisor, repetitions and store in one process, without Ray: quick to kill, and to start again."""

import sys
from collections.abc import Callable
from math import inf
from time import sleep

from sqlalchemy import select

from gaplab.schemas.lifecycle import State
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.running import execution
from gaplab.services.running.execution import Claim
from gaplab.services.specs.assembly import setting
from gaplab.services.store.models import RepetitionRow
from gaplab.services.store.session import Store
from gaplab.workers.repetitions import Repetitions
from gaplab.workers.supervisor import Supervisor
from gaplab.workers.task import Run, delivered

SPEC = ExperimentSpec.model_validate(
    {
        "strategy": {"name": "informative", "options": {"simulators": 3}},
        "robot": "toy_function",
        "optimizer": {"name": "steady_state", "options": {"population": 4}},
        "iterations": 1,
        "repetitions": 2,
        "budget": {"controller_evaluations": 6, "selection_evaluations": 6, "simulator_evaluations": 6},
    }
)
"""Every kind of step, each with checkpoints."""

OPEN = (State.QUEUED, State.RUNNING)

ROUNDS = 2_000
"""More than any run takes."""


class HereRun(Run):
    """A run whose repetition is computed by this process."""

    def receive(self) -> None:
        """The next batch, or the end."""
        batch = next(self.stream, None)
        self.ended = batch is None
        self.take(batch or ())

    def cancel(self) -> None:
        """What computes it ends with its next delivery."""
        self.stream.close()


class NoChecks:
    """Sensitivity checks are left to Ray."""

    def step(self) -> None:
        """None runs."""

    def heartbeat(self) -> None:
        """None is held."""

    def hand_back(self) -> None:
        """None was taken."""


class HereRepetitions(Repetitions):
    """Repetitions that this process computes; each round looks for work."""

    def claim(self, capacity: Callable[[], int]) -> None:
        """Hand back what should not start now, and claim up to the capacity."""
        self._looked = -inf
        super().claim(capacity)

    def launch(self, claim: Claim) -> Run:
        """Compute the repetition in this process."""
        stream = delivered(lambda: setting(claim.spec, claim.number), claim, self._checkpoint_s)
        return HereRun(claim, stream)

    def receive(self) -> None:
        """Take the next batch of each run."""
        for run in self.runs:
            if not run.over:
                run.receive()


class Here(Supervisor):
    """The supervisor as it is, but for Ray: each round has a heartbeat, each answer of a simulator is a checkpoint."""

    repetitions: type[HereRepetitions] = HereRepetitions

    def __init__(self, store: Store, checkpoint_s: float = 0.0) -> None:
        super().__init__(store, lambda: 2)
        self._repetitions = self.repetitions(store, self._owner, {}, checkpoint_s)
        self._checks = NoChecks()  # type: ignore[assignment]

    def _heartbeat(self) -> None:
        self._beat = -inf
        super()._heartbeat()


class Stop:
    """An Event that is set after some looks at it."""

    def __init__(self, looks: int) -> None:
        self._looks = looks

    def is_set(self) -> bool:
        """Whether that many looks were taken."""
        self._looks -= 1
        return self._looks < 0

    def wait(self, seconds: float) -> None:
        """As an Event."""
        sleep(seconds)


def work(url: str) -> None:
    """What a supervisor does from its start to the end of all that is queued; it is told to stop once on the way."""
    store = Store(url)
    execution.requeue_lost(store, stale_after_s=-1.0)  # half a minute has passed since the last one died
    Here(store).serve(Stop(8))  # type: ignore[arg-type]
    last = Here(store)
    for _ in range(ROUNDS):
        last.step()
        with store.reading() as session:
            if not session.scalars(select(RepetitionRow.id).where(RepetitionRow.state.in_(OPEN))).all():
                return
    sys.exit("it does not come to an end")
