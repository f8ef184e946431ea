"""Repetitions at Ray: the task that computes one, and the supervisor's hold on its claimed repetitions."""

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from threading import Event
from time import monotonic, perf_counter

import ray
from ray import ObjectRefGenerator
from ray.exceptions import RayError, RayTaskError

from gaplab.services.core.errors import ClusterUnusable, Conflict, PluginDiffers, StoreUnavailable
from gaplab.services.core.types import Measured, Probed
from gaplab.services.running import execution
from gaplab.services.running.execution import Checkpoint, Claim, Delivered
from gaplab.services.specs.assembly import setting
from gaplab.services.store.session import Store
from gaplab.workers.checkpoints import CHECKPOINT_S, recorded
from gaplab.workers.nodes import Versions, check_here
from gaplab.workers.plugins import Plugins
from gaplab.workers.pool import Pool

BATCH_S = 0.2
"""Steps shorter than this travel together; what reality answered never waits."""

WAIT_S = 0.2
"""Longest wait for a delivery, and shortest time between two looks for queued work."""

log = logging.getLogger("gaplab.supervisor")


@ray.remote(num_cpus=1, max_retries=0, num_returns="streaming")
def run(claim: Claim, expected: Versions, checkpoint_s: float) -> Iterator[tuple[Delivered, ...]]:
    """Yield the steps that follow the claim's log, in batches; the first, empty batch says that the task has begun.

    Ray never retries it: a repetition goes on from its stored log, not from its beginning. The engine stays warm in
    the worker process from one task to the next.

    Raises:
        ClusterUnusable: this node lacks the expected versions.
        PluginDiffers: this process lacks those of the plug-ins.
    """
    check_here(expected)
    yield ()
    alone = setting(claim.spec, claim.number)
    pool = Pool(claim.spec, alone.simulate, alone.batch_size(), expected)
    spread = replace(alone, simulate=pool, batch_size=pool.batch_size)
    yield from batches(recorded(spread, claim.log, claim.checkpoints, checkpoint_s))


def batches(deliveries: Iterator[Delivered]) -> Iterator[tuple[Delivered, ...]]:
    """Yield the deliveries in batches; a batch ends with an answer of reality or a checkpoint, or when it is old."""
    batch: list[Delivered] = []
    begun = perf_counter()
    for delivered in deliveries:
        batch.append(delivered)
        urgent = isinstance(delivered, Checkpoint) or isinstance(delivered.step, Measured | Probed)
        if urgent or perf_counter() - begun >= BATCH_S:
            yield tuple(batch)
            batch = []
            begun = perf_counter()
    if batch:
        yield tuple(batch)


@dataclass(eq=False)
class Run:
    """A claimed repetition on its way.

    Attributes:
        claim: the right to it.
        stream: batches of steps and checkpoints from the task.
        received: deliveries that are not stored yet.
        begun: the task no longer waits for a core.
        ended: the task has come to its end.
        failed: why its code raised, or its process refused it.
        lost: why another worker must go on: its worker is gone, or its log refused a delivery.
    """

    claim: Claim
    stream: ObjectRefGenerator
    received: list[Delivered] = field(default_factory=list)
    begun: bool = False
    ended: bool = False
    failed: str | PluginDiffers | None = None
    lost: str | None = None

    def receive(self) -> None:
        """Take a batch that the stream has ready, its end, or the reason why there is none."""
        try:
            self.received += ray.get(next(self.stream))
            self.begun = True
        except StopIteration:
            self.ended = True
        except RayTaskError as error:
            if isinstance(error.cause, ClusterUnusable):
                raise error.cause from error
            differs = isinstance(error.cause, PluginDiffers)
            self.failed = error.cause if differs else f"{type(error.cause).__name__}: {error.cause}"
        except RayError as error:
            self.lost = f"the worker was lost: {type(error).__name__}"

    def cancel(self) -> None:
        """End the task at once."""
        ray.cancel(self.stream, force=True)

    @property
    def over(self) -> bool:
        """Whether the stream has nothing more to give."""
        return self.ended or self.failed is not None or self.lost is not None

    @property
    def place(self) -> dict[str, str | int]:
        """Experiment and number, for the log."""
        return {"experiment": self.claim.experiment_id, "repetition": self.claim.number}


class Repetitions:
    """The repetitions that one supervisor has claimed. All methods raise StoreUnavailable; nothing is lost by it.

    Args:
        store: the database.
        owner: the supervisor's name in it.
        versions: that a node must have to run them.
        checkpoint_s: seconds between the checkpoints of a step.
    """

    def __init__(self, store: Store, owner: str, versions: Versions, checkpoint_s: float = CHECKPOINT_S) -> None:
        self.runs: list[Run] = []
        self._store = store
        self._owner = owner
        self._plugins = Plugins(versions)
        self._checkpoint_s = checkpoint_s
        self._looked = -WAIT_S
        self._unsure = False

    def launch(self, claim: Claim) -> Run:
        """Give a claimed repetition to a Ray task."""
        return Run(claim, run.remote(claim, self._plugins.expected(claim.spec), self._checkpoint_s))

    def heartbeat(self) -> None:
        """Prolong the claims, and stop the runs whose claim no longer holds."""
        self._drop_all_but(execution.heartbeat(self._store, [run.claim for run in self.runs]))

    def claim(self, capacity: Callable[[], int]) -> None:
        """Hand back what should not begin now, and claim up to the capacity."""
        if monotonic() - self._looked < WAIT_S:
            return
        self._looked = monotonic()
        waiting = [run.claim for run in self.runs if not (run.begun or run.over)]
        present = self._plugins.present()
        if given := set(execution.give_way(self._store, waiting, *present)):
            self._drop_all_but([run.claim for run in self.runs if run.claim not in given])
        if self._unsure:
            execution.hand_back_unheard(self._store, self._owner, [run.claim for run in self.runs])
        self._unsure = True
        claims = execution.claim(self._store, self._owner, capacity() - len(self.runs), *present)
        self._unsure = False
        for claim in claims:
            self.runs.append(self.launch(claim))
            log.info("on from step %d", len(claim.log), extra=self.runs[-1].place)

    def receive(self) -> None:
        """Wait shortly for deliveries, and take the ready ones."""
        streams = {run.stream: run for run in self.runs if not run.over}
        if not streams:
            Event().wait(WAIT_S)
            return
        ready, _ = ray.wait(list(streams), num_returns=len(streams), timeout=0)
        if not ready:
            ready, _ = ray.wait(list(streams), num_returns=1, timeout=WAIT_S)
        for stream in ready:
            streams[stream].receive()

    def store_received(self) -> None:
        """Record what was received, and stop the runs whose claim no longer holds."""
        filled = [run for run in self.runs if run.received]
        if not filled:
            return
        try:
            held = execution.record_all(self._store, [(run.claim, run.received) for run in filled])
        except Conflict:
            held = self._record_each(filled)
        for run in filled:
            run.received = []
        self._drop_all_but([*held, *(run.claim for run in self.runs if run not in filled)])

    def end(self) -> None:
        """Complete, fail or release the repetitions whose task is over."""
        over = [run for run in self.runs if run.over]
        if not over:
            return
        self._complete([run for run in over if run.ended and run.lost is None])
        for run in over:
            if isinstance(run.failed, PluginDiffers):
                self._plugins.hand_back(self._store, run.claim, run.failed)
            elif run.failed is not None:
                execution.fail(self._store, run.claim, run.failed)
                log.error("failed: %s", run.failed, extra=run.place)
            elif run.lost is not None:
                execution.release(self._store, run.claim, run.lost)
                log.warning("queued again: %s", run.lost, extra=run.place)
            else:
                log.info("completed", extra=run.place)
            self.runs.remove(run)
        self._looked = -WAIT_S  # cores are free: look for work at once

    def hand_back(self, runs: list[Run]) -> None:
        """Stop these runs, and let others go on with them; what the database does not hear, a lease's end tells it."""
        for run in list(runs):
            run.cancel()
            self.runs.remove(run)
            try:
                execution.hand_back(self._store, run.claim)
            except StoreUnavailable as error:
                log.warning("not handed back, so its lease must expire: %s", error, extra=run.place)
            else:
                log.info("handed back", extra=run.place)

    def _record_each(self, runs: list[Run]) -> tuple[Claim, ...]:
        """Record each run's deliveries by themselves, and give up the runs whose log refuses them."""
        held: list[Claim] = []
        for run in runs:
            try:
                held += execution.record_all(self._store, [(run.claim, run.received)])
            except Conflict as error:
                run.cancel()
                run.received, run.lost = [], f"what it delivered could not be stored: {error}"
                held.append(run.claim)
        return tuple(held)

    def _complete(self, runs: list[Run]) -> None:
        try:
            execution.complete(self._store, *(run.claim for run in runs))
        except Conflict:
            for run in runs:
                try:
                    execution.complete(self._store, run.claim)
                except Conflict as error:
                    run.lost = f"it ended too early: {error}"

    def _drop_all_but(self, held: list[Claim] | tuple[Claim, ...]) -> None:
        """Stop the runs whose claim no longer holds: cancelled, paused, stopped, handed back, or taken over."""
        claims = set(held)
        for run in [run for run in self.runs if run.claim not in claims]:
            run.cancel()
            self.runs.remove(run)
            log.info("dropped, it is no longer ours", extra=run.place)
