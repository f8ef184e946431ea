"""The supervisor: claims work, gives it to Ray tasks, and alone writes what they deliver.

It keeps nothing that it could not lose: killed at any moment and started again, it goes on from the stored steps.
"""

import logging
import os
import socket
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from secrets import token_hex
from threading import Event
from time import monotonic

from gaplab.services.core.errors import RayGone, StoreChanged, StoreUnavailable
from gaplab.services.running import execution, supervisors
from gaplab.services.running.pulse import Pulse
from gaplab.services.store.session import Store
from gaplab.workers.checkpoints import CHECKPOINT_S
from gaplab.workers.nodes import Versions
from gaplab.workers.repetitions import Repetitions
from gaplab.workers.sensitivity import Checks

HEARTBEATS = 6
"""Heartbeats in the time after which a lease without one is lost."""

RETRY_S = 1.0
"""Wait before the next try while the database cannot be used."""

GRACE_S = 15.0
"""Longest wait, once it is told to stop, for one more delivery of each repetition."""

log = logging.getLogger("gaplab.supervisor")


class Supervisor:
    """Runs what is queued in the store.

    Args:
        store: the database.
        capacity: number of repetitions to have at Ray at once, asked before each claim.
        versions: that a node must have to run them.
        checkpoint_s: seconds between the checkpoints of a long step.
        lease_s: silence after which a supervisor's work goes to others; the same for all supervisors.
        pulse: to the process that keeps this one; left out: none does.
    """

    def __init__(
        self,
        store: Store,
        capacity: Callable[[], int],
        versions: Versions | None = None,
        *,
        checkpoint_s: float = CHECKPOINT_S,
        lease_s: float = execution.STALE_AFTER_S,
        pulse: Pulse | None = None,
    ) -> None:
        self._store = store
        self._capacity = capacity
        self._owner = f"{socket.gethostname()}:{os.getpid()}:{token_hex(4)}"
        self._repetitions = Repetitions(store, self._owner, versions or {}, checkpoint_s)
        self._checks = Checks(store, self._owner, lease_s, versions)
        self._lease_s = lease_s
        self._beat = -lease_s
        self._noted: datetime | None = None
        self._pulse = pulse or Pulse()
        self._pulse.name(self._owner)

    @property
    def busy(self) -> bool:
        """Whether repetitions are under way."""
        return bool(self._repetitions.runs)

    def serve(self, stop: Event) -> None:
        """Work until told to stop; then hand unfinished repetitions back, each after one more delivery.

        Raises:
            ClusterUnusable: a node would compute other numbers, or Ray died; this ends the work as well.
            StoreChanged: the database was replaced, restored or migrated; nothing more is written to it.
        """
        try:
            while not stop.is_set():
                try:
                    self.step()
                except StoreChanged:
                    raise
                except StoreUnavailable as error:
                    log.warning("waiting: %s", error)
                    stop.wait(RETRY_S)
            self._wind_down()
        except RayGone:
            self._repetitions.runs.clear()  # nothing answers that could end them
            raise
        finally:
            self._repetitions.hand_back(self._repetitions.runs)
            with suppress(StoreUnavailable):  # then their leases will run out
                execution.hand_back_unheard(self._store, self._owner, ())
            with suppress(StoreUnavailable):
                self._checks.hand_back()
            with suppress(StoreUnavailable):  # then it counts as lost, which it nearly is
                supervisors.end(self._store, self._owner)

    def step(self) -> None:
        """Do one round: heartbeat, claim, receive, store; sensitivity checks before repetitions.

        Raises:
            StoreUnavailable: nothing is lost by it; what was received is stored in a later round.
            StoreChanged: it is not the database that this supervisor knows; what was received is void.
            ClusterUnusable: a node that joined has other versions; nothing of it is stored.
        """
        self._pulse.beat()
        self._heartbeat()
        self._checks.step()
        self._repetitions.claim(self._capacity)
        self._repetitions.receive()
        self._repetitions.store_received()
        self._repetitions.end()

    def _heartbeat(self) -> None:
        if monotonic() - self._beat < self._lease_s / HEARTBEATS:
            return
        self._store.check()
        self._noted = supervisors.heartbeat(self._store, self._owner, self._noted)
        self._repetitions.heartbeat()
        self._checks.heartbeat()
        if requeued := execution.requeue_lost(self._store, stale_after_s=self._lease_s):
            log.warning("%d repetitions whose supervisor was lost are queued again", requeued)
        self._beat = monotonic()

    def _wind_down(self) -> None:
        """Hand each repetition back after one more delivery, or at once if it waits for a core."""
        repetitions, until = self._repetitions, monotonic() + GRACE_S
        repetitions.hand_back([run for run in repetitions.runs if not run.begun])
        while repetitions.runs and monotonic() < until:
            self._pulse.beat()
            try:
                self._heartbeat()
                repetitions.receive()
                delivered = [run for run in repetitions.runs if run.received]
                repetitions.store_received()
                repetitions.end()
            except StoreChanged:
                raise
            except StoreUnavailable as error:
                log.warning("waiting: %s", error)
                Event().wait(RETRY_S)
            else:
                repetitions.hand_back([run for run in delivered if run in repetitions.runs])
