"""The supervisor: it claims work, gives it to tasks elsewhere, and is the only writer of their deliveries.

It has no state of its own: killed at any moment and restarted, it continues from the stored steps.
"""

import logging
import os
import socket
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from functools import partial
from secrets import token_hex
from threading import Event
from time import monotonic, sleep

from gaplab.services.experiments.lease_ends import Silences
from gaplab.services.measuring.taking import open_again
from gaplab.services.running import execution, supervisors
from gaplab.services.running.leases import STALE_AFTER_S
from gaplab.services.running.pulse import PulsePipe
from gaplab.services.store.database_errors import StoreChanged, StoreUnavailable
from gaplab.services.store.session import Store
from gaplab.workers.checkpoints import CHECKPOINT_S
from gaplab.workers.errors import RayGone
from gaplab.workers.repetitions import Repetitions
from gaplab.workers.task import Patience, Tasks, stuck

LOOK_S = 0.1
"""Longest time until a request to stop is noticed."""


class Stop:
    """A flag without a lock, unlike an Event: a signal that arrives while an Event is being set waits for itself."""

    def __init__(self) -> None:
        self._set = False

    def set(self) -> None:
        """Request a stop; again is harmless."""
        self._set = True

    def is_set(self) -> bool:
        """Return whether a stop was requested."""
        return self._set

    def wait(self, seconds: float) -> None:
        """Wait, but not longer than until a stop is requested."""
        until = monotonic() + seconds
        while not self._set and (left := until - monotonic()) > 0:
            sleep(min(LOOK_S, left))


HEARTBEATS = 6
"""Number of heartbeats within the time after which a lease without one is lost."""

RETRY_S = 1.0
"""Pause before the next attempt while the database cannot be used."""

GRACE_S = 15.0
"""Longest wait for one more delivery of each repetition, after a request to stop."""

log = logging.getLogger("gaplab.supervisor")


class Supervisor:
    """Runs the queued work of a store.

    Before each claim, `capacity` returns the number of repetitions to give to `tasks` at once. All supervisors have the
    same `lease_s`: without a heartbeat for so long, one loses its work.
    """

    def __init__(
        self,
        store: Store,
        capacity: Callable[[], int],
        tasks: Tasks,
        *,
        checkpoint_s: float = CHECKPOINT_S,
        lease_s: float = STALE_AFTER_S,
        patience: Patience | None = None,
    ) -> None:
        self._store = store
        self._capacity = capacity
        self._owner = f"{socket.gethostname()}:{os.getpid()}:{token_hex(4)}"
        patience = patience or Patience()
        self._repetitions = Repetitions(store, self._owner, tasks, checkpoint_s, patience, lease_s)
        self._checks = tasks.checks(store, self._owner, lease_s, patience)
        self._takes = Silences[str]()
        self._lease_s, self._start_s = lease_s, patience.start_s
        self._beat = -lease_s
        self._noted: datetime | None = None
        self._pulse = PulsePipe()

    @property
    def busy(self) -> bool:
        """Whether repetitions are running."""
        return bool(self._repetitions.runs)

    def serve(self, stop: Stop | Event, pulse: PulsePipe | None = None) -> None:
        """Work until `stop` is set; then hand back unfinished repetitions, each after one more delivery.

        The pulse goes to the process that restarts this one; None if no process does.

        Raises:
            ClusterUnusable: a node would compute other numbers, or Ray died; this ends the work as well.
            StoreChanged: the database was replaced, restored or migrated; what its leases do not permit is not written.
        """
        self._pulse = pulse or self._pulse
        self._pulse.name(self._owner)
        ending = self.hand_back
        try:
            while not stop.is_set():
                try:
                    self.step()
                except StoreChanged:
                    raise
                except StoreUnavailable as error:
                    self._pulse.trouble = str(error)
                    log.warning("waiting: %s", error)
                    self._takes.forget()
                    stop.wait(RETRY_S)
            self._wind_down()
        except RayGone as error:
            ending = partial(self._abandon, str(error))
            raise
        finally:
            ending()

    def hand_back(self) -> None:
        """Return all leases, and forget this supervisor."""
        self._repetitions.hand_back(self._repetitions.runs)
        with suppress(StoreUnavailable):  # then their leases will run out
            execution.hand_back_unheard(self._store, self._owner, ())
        with suppress(StoreUnavailable):
            self._checks.hand_back()
        with suppress(StoreUnavailable):  # then it counts as lost, which it nearly is
            supervisors.end(self._store, self._owner)

    def _abandon(self, reason: str) -> None:
        """Queue the work again that a dead Ray held; its tasks cannot be ended, for nothing answers."""
        self._repetitions.runs.clear()
        with suppress(StoreUnavailable):  # then the leases will run out
            supervisors.release(self._store, self._owner, reason)

    def step(self) -> None:
        """Do one round: heartbeat, claim, receive, store; sensitivity checks before repetitions.

        Raises:
            StoreUnavailable: the database cannot be used; received deliveries are stored in a later round.
            StoreChanged: it is not the database that this supervisor knows; deliveries need a valid lease there.
            ClusterUnusable: a node that joined has other versions; its deliveries are not stored.
        """
        self._pulse.beat()
        self._heartbeat()
        self._checks.step()
        self._repetitions.claim(self._capacity)
        self._repetitions.receive()
        self._repetitions.store_received()
        self._repetitions.end()
        self._pulse.trouble = stuck(self._repetitions.runs, self._start_s)

    def _heartbeat(self) -> None:
        if monotonic() - self._beat < self._lease_s / HEARTBEATS:
            return
        self._store.check()
        self._noted = supervisors.heartbeat(self._store, self._owner, self._noted)
        self._repetitions.heartbeat()
        self._checks.heartbeat()
        self._repetitions.requeue_lost()
        if opened := open_again(self._store, self._takes):
            log.warning("%d requests whose take ran out are open again", opened)
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
