"""The supervisor: claims repetitions, gives each to a Ray task, and is the only one who writes their steps.

It keeps nothing that it could not lose: killed at any moment and started again, it goes on from the stored steps.
"""

import logging
import os
import socket
from collections.abc import Callable
from contextlib import suppress
from secrets import token_hex
from threading import Event
from time import monotonic

import ray

from gaplab.services.core.errors import Conflict, StoreUnavailable
from gaplab.services.running import execution, supervisors
from gaplab.services.running.execution import Claim
from gaplab.services.store.session import Store
from gaplab.workers import repetition
from gaplab.workers.checkpoints import CHECKPOINT_S
from gaplab.workers.nodes import Versions
from gaplab.workers.run import Run as Run
from gaplab.workers.sensitivity import Checks

HEARTBEATS = 6
"""In the time after which a lease without one is lost."""

WAIT_S = 0.2
"""How long the supervisor waits for something to happen before it looks for new work."""

RETRY_S = 1.0
"""How long it waits for a database that cannot be used now."""

GRACE_S = 15.0
"""How long it waits, when it is told to stop, for repetitions to deliver what they have done since the last time."""

log = logging.getLogger("gaplab.supervisor")


class Supervisor:
    """Runs whatever is queued in the store.

    Args:
        store: the database.
        capacity: how many repetitions to have at Ray at once, as things are when it is asked.
        versions: that a node must have to run them.
        checkpoint_s: between the checkpoints of a step that takes long.
        lease_s: for how long a supervisor may be silent before its work goes to others; the same for all of them.
    """

    def __init__(
        self,
        store: Store,
        capacity: Callable[[], int],
        versions: Versions | None = None,
        *,
        checkpoint_s: float = CHECKPOINT_S,
        lease_s: float = execution.STALE_AFTER_S,
    ) -> None:
        self._store = store
        self._capacity = capacity
        self._versions = versions or {}
        self._checkpoint_s = checkpoint_s
        self._owner = f"{socket.gethostname()}:{os.getpid()}:{token_hex(4)}"
        self._runs: list[Run] = []
        self._checks = Checks(store, self._owner, lease_s, self._versions)
        self._lease_s = lease_s
        self._beat = -lease_s
        self._looked = -WAIT_S
        self._unsure = False

    @property
    def busy(self) -> bool:
        """Whether repetitions are under way."""
        return bool(self._runs)

    def serve(self, stop: Event) -> None:
        """Work until told to stop; then give the unfinished repetitions back, each after one more delivery of its own.

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
            self._wind_down()
        finally:
            self._hand_back(self._runs)
            with suppress(StoreUnavailable):  # then their leases will run out
                execution.hand_back_unheard(self._store, self._owner, ())
            with suppress(StoreUnavailable):
                self._checks.hand_back()
            with suppress(StoreUnavailable):  # then it is taken for lost, which it nearly is
                supervisors.end(self._store, self._owner)

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
        supervisors.heartbeat(self._store, self._owner)
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
        waiting = [run.claim for run in self._runs if not (run.begun or run.over)]
        if given := set(execution.give_way(self._store, waiting)):
            self._drop_all_but([run.claim for run in self._runs if run.claim not in given])
        if self._unsure:
            execution.hand_back_unheard(self._store, self._owner, [run.claim for run in self._runs])
        self._unsure = True
        claims = execution.claim(self._store, self._owner, self._capacity() - len(self._runs))
        self._unsure = False
        for claim in claims:
            self._runs.append(self._launch(claim))
            log.info("on from step %d", len(claim.log), extra=self._runs[-1].place)

    def _launch(self, claim: Claim) -> Run:
        return Run(claim, repetition.run.remote(claim, self._versions, self._checkpoint_s))

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
        try:
            held = execution.record_all(self._store, [(run.claim, run.received) for run in filled])
        except Conflict:
            held = self._record_each(filled)
        for run in filled:
            run.received = []
        self._drop_all_but([*held, *(run.claim for run in self._runs if run not in filled)])

    def _record_each(self, runs: list[Run]) -> tuple[Claim, ...]:
        """Store what each has delivered by itself; one whose log refuses it is given up, and nobody else with it."""
        held: list[Claim] = []
        for run in runs:
            try:
                held += execution.record_all(self._store, [(run.claim, run.received)])
            except Conflict as error:
                run.cancel()
                run.received, run.lost = [], f"what it delivered could not be stored: {error}"
                held.append(run.claim)
        return tuple(held)

    def _end(self) -> None:
        over = [each for each in self._runs if each.over]
        if not over:
            return
        self._complete([run for run in over if run.ended and run.lost is None])
        for run in over:
            if run.failed is not None:
                execution.fail(self._store, run.claim, run.failed)
                log.error("failed: %s", run.failed, extra=run.place)
            elif run.lost is not None:
                execution.release(self._store, run.claim, run.lost)
                log.warning("queued again: %s", run.lost, extra=run.place)
            else:
                log.info("completed", extra=run.place)
            self._runs.remove(run)
        self._looked = -WAIT_S  # cores are free: look for work at once

    def _complete(self, runs: list[Run]) -> None:
        try:
            execution.complete_all(self._store, [run.claim for run in runs])
        except Conflict:
            for run in runs:
                try:
                    execution.complete_all(self._store, [run.claim])
                except Conflict as error:
                    run.lost = f"it ended too early: {error}"

    def _drop_all_but(self, held: list[Claim] | tuple[Claim, ...]) -> None:
        """Stop the runs whose claim holds no more: cancelled, paused, stopped, given back, or taken over."""
        keys = {(claim.repetition_id, claim.epoch) for claim in held}
        for run in [each for each in self._runs if (each.claim.repetition_id, each.claim.epoch) not in keys]:
            run.cancel()
            self._runs.remove(run)
            log.info("dropped, it is no longer ours", extra=run.place)

    def _wind_down(self) -> None:
        """Hand each repetition back once its step is stored, or a checkpoint of it; what waits for a core, now."""
        until = monotonic() + GRACE_S
        self._hand_back([run for run in self._runs if not run.begun])
        while self._runs and monotonic() < until:
            try:
                self._heartbeat()
                self._receive()
                delivered = [run for run in self._runs if run.received]
                self._store_received()
                self._end()
            except StoreUnavailable as error:
                log.warning("waiting: %s", error)
                Event().wait(RETRY_S)
            else:
                self._hand_back([run for run in delivered if run in self._runs])

    def _hand_back(self, runs: list[Run]) -> None:
        for run in list(runs):
            run.cancel()
            self._runs.remove(run)
            try:
                execution.hand_back(self._store, run.claim)
            except StoreUnavailable as error:
                log.warning("its lease will run out: %s", error, extra=run.place)
            else:
                log.info("handed back", extra=run.place)
