"""The supervisor: claims repetitions, gives each to a Ray task, and is the only one who writes their steps.

It keeps nothing that it could not lose: killed at any moment and started again, it goes on from the stored steps.
"""

import logging
import os
import socket
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from secrets import token_hex
from threading import Event
from time import monotonic

import ray
from ray import ObjectRefGenerator
from ray.exceptions import RayError, RayTaskError

from services import execution
from services.core.errors import ClusterUnusable, StoreUnavailable
from services.execution import Claim, TimedStep
from services.store.session import Store
from workers import repetition
from workers.nodes import Versions
from workers.sensitivity import Checks

HEARTBEATS = 6
"""In the time after which a lease without one is lost."""

WAIT_S = 0.2
"""How long the supervisor waits for something to happen before it looks for new work."""

RETRY_S = 1.0
"""How long it waits for a database that cannot be used now."""

log = logging.getLogger("gaplab.supervisor")


@dataclass(eq=False)
class Run:
    """A claimed repetition on its way.

    Attributes:
        claim: the right to it.
        stream: batches of steps, as the task computes them.
        received: steps that are not yet stored.
        ended: the task is over; nothing more will be received.
        failed: why its code raised.
        lost: why its worker is gone.
    """

    claim: Claim
    stream: ObjectRefGenerator
    received: list[TimedStep] = field(default_factory=list)
    ended: bool = False
    failed: str | None = None
    lost: str | None = None

    def receive(self) -> None:
        """Take what the stream has ready: a batch, its end, or why there will be no end."""
        try:
            self.received += ray.get(next(self.stream))
        except StopIteration:
            self.ended = True
        except RayTaskError as error:
            if isinstance(error.cause, ClusterUnusable):
                raise error.cause from error
            self.failed = f"{type(error.cause).__name__}: {error.cause}"
        except RayError as error:
            self.lost = f"the worker was lost: {type(error).__name__}"

    @property
    def over(self) -> bool:
        """Whether the stream has nothing more to give."""
        return self.ended or self.failed is not None or self.lost is not None

    @property
    def name(self) -> str:
        """The experiment and the number, for the log."""
        return f"{self.claim.experiment_id}/{self.claim.number}"


class Supervisor:
    """Runs whatever is queued in the store.

    Args:
        store: the database.
        capacity: how many repetitions to have at Ray at once, as things are when it is asked.
        versions: that a node must have to run them.
        lease_s: for how long a supervisor may be silent before its work goes to others; the same for all of them.
    """

    def __init__(
        self,
        store: Store,
        capacity: Callable[[], int],
        versions: Versions | None = None,
        *,
        lease_s: float = execution.STALE_AFTER_S,
    ) -> None:
        self._store = store
        self._capacity = capacity
        self._versions = versions or {}
        self._owner = f"{socket.gethostname()}:{os.getpid()}:{token_hex(4)}"
        self._runs: list[Run] = []
        self._checks = Checks(store, self._owner, lease_s)
        self._lease_s = lease_s
        self._beat = -lease_s
        self._looked = -WAIT_S

    @property
    def busy(self) -> bool:
        """Whether repetitions are under way."""
        return bool(self._runs)

    def serve(self, stop: Event) -> None:
        """Work until told to stop; then give the unfinished repetitions back to whoever comes next.

        Raises:
            ClusterUnusable: a node would compute other numbers; this ends the work as well.
        """
        try:
            while not stop.is_set():
                try:
                    self.step()
                except StoreUnavailable as error:
                    log.warning("waiting: %s", error)
                    stop.wait(RETRY_S)
        finally:
            self._hand_back()

    def step(self) -> None:
        """One round: heartbeat, claim, receive, store; sensitivity checks before repetitions.

        Raises:
            StoreUnavailable: nothing is lost by it; what was received is stored in a later round.
            ClusterUnusable: a node that joined has other versions; nothing of it is stored.
        """
        self._heartbeat()
        self._checks.step()
        self._claim()
        self._receive()
        self._store_received()
        self._end()

    def _heartbeat(self) -> None:
        if monotonic() - self._beat < self._lease_s / HEARTBEATS:
            return
        held = execution.heartbeat(self._store, [run.claim for run in self._runs])
        self._drop_all_but(held)
        self._checks.heartbeat()
        requeued = execution.requeue_lost(self._store, stale_after_s=self._lease_s)
        if requeued:
            log.warning("%d repetitions whose supervisor was lost are queued again", requeued)
        self._beat = monotonic()

    def _claim(self) -> None:
        if monotonic() - self._looked < WAIT_S:
            return
        self._looked = monotonic()
        for claim in execution.claim(self._store, self._owner, self._capacity() - len(self._runs)):
            self._runs.append(self._launch(claim))
            log.info("%s: on from step %d", self._runs[-1].name, len(claim.log))

    def _launch(self, claim: Claim) -> Run:
        return Run(claim, repetition.run.remote(claim.spec, claim.number, claim.log, self._versions))

    def _receive(self) -> None:
        streams = {run.stream: run for run in self._runs if not run.over}
        if not streams:
            Event().wait(WAIT_S)
            return
        ready, _ = ray.wait(list(streams), num_returns=len(streams), timeout=0)
        if not ready:
            ready, _ = ray.wait(list(streams), num_returns=1, timeout=WAIT_S)
        for stream in ready:
            streams[stream].receive()

    def _store_received(self) -> None:
        filled = [run for run in self._runs if run.received]
        if not filled:
            return
        held = execution.record_all(self._store, [(run.claim, run.received) for run in filled])
        for run in filled:
            run.received = []
        self._drop_all_but([*held, *(run.claim for run in self._runs if run not in filled)])

    def _end(self) -> None:
        over = [each for each in self._runs if each.over]
        if not over:
            return
        execution.complete_all(self._store, [run.claim for run in over if run.ended])
        for run in over:
            if run.failed is not None:
                execution.fail(self._store, run.claim, run.failed)
                log.error("%s: failed: %s", run.name, run.failed)
            elif run.lost is not None:
                execution.release(self._store, run.claim, run.lost)
                log.warning("%s: queued again: %s", run.name, run.lost)
            else:
                log.info("%s: completed", run.name)
            self._runs.remove(run)
        self._looked = -WAIT_S  # cores are free: look for work at once

    def _drop_all_but(self, held: list[Claim] | tuple[Claim, ...]) -> None:
        """Stop the runs whose claim holds no more: cancelled, or taken over."""
        keys = {(claim.repetition_id, claim.epoch) for claim in held}
        for run in [each for each in self._runs if (each.claim.repetition_id, each.claim.epoch) not in keys]:
            ray.cancel(run.stream, force=True)
            self._runs.remove(run)
            log.info("%s: dropped, it is no longer ours", run.name)

    def _hand_back(self) -> None:
        for run in self._runs:
            try:
                execution.hand_back(self._store, run.claim)
            except StoreUnavailable as error:
                log.warning("%s: its lease will run out: %s", run.name, error)
        self._runs = []
        with suppress(StoreUnavailable):  # then its lease will run out
            self._checks.hand_back()
