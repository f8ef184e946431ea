"""The real supervisor, repetitions and store in one process, without Ray: quick to kill, and to start again."""

import sys
from collections.abc import Callable
from math import inf
from time import sleep
from typing import Any

from sqlalchemy import select

from gaplab.schemas.lifecycle import State
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.store.lease import Claim
from gaplab.services.store.models import RepetitionRow
from gaplab.services.store.session import Store
from gaplab.workers.process_tasks import NoChecks
from gaplab.workers.repetitions import Repetitions
from gaplab.workers.supervisor import Supervisor
from gaplab.workers.task import Batch, delivered

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


class HereTask:
    """A repetition that this process computes as its batches are taken."""

    def __init__(self, stream: Any) -> None:
        self.stream = stream

    def take(self) -> Batch | None:
        """The next batch, or the end."""
        batch: Batch | None = next(self.stream, None)
        return batch

    def cancel(self) -> None:
        """What computes it ends with its next delivery."""
        self.stream.close()


class HereTasks:
    """Tasks that this process computes."""

    def __init__(self) -> None:
        self.versions: dict[str, str] = {}

    def start(self, claim: Claim, expected: Any, checkpoint_s: float) -> HereTask:
        """Compute it in this process."""
        return HereTask(delivered(lambda: setting(claim.spec, claim.number), claim, checkpoint_s))

    def ready(self, tasks: Any, longest_s: float) -> Any:
        """Each has a batch, once it is computed."""
        return tasks

    def permit(self, keys: Any, until: float) -> None:
        """Nothing moves."""

    def checks(self, *_: Any) -> NoChecks:
        """They are left to Ray."""
        return NoChecks()


class HereRepetitions(Repetitions):
    """Repetitions that this process computes; each round looks for work."""

    def claim(self, capacity: Callable[[], int]) -> None:
        """Hand back what should not start now, and claim up to the capacity."""
        self._looked = -inf
        super().claim(capacity)


class Here(Supervisor):
    """The supervisor as it is, but for Ray: each round has a heartbeat, each answer of a simulator is a checkpoint."""

    tasks: type[HereTasks] = HereTasks

    def __init__(self, store: Store, checkpoint_s: float = 0.0) -> None:
        super().__init__(store, lambda: 2, self.tasks())
        self._repetitions = HereRepetitions(store, self._owner, self.tasks(), checkpoint_s)

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
