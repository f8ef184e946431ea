"""The supervisor as a process that is started again when it dies, and killed when it hangs."""

import logging
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from threading import Event, Thread
from time import monotonic
from typing import TYPE_CHECKING

from gaplab.api.process.child_process import end, kill, start
from gaplab.services.running import supervisors
from gaplab.services.running.pulse import VARIABLE, Heard
from gaplab.services.settings import Settings
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.engine import PATIENCE_S
from gaplab.services.store.session import Store

if TYPE_CHECKING:
    import subprocess

log = logging.getLogger("gaplab.service")

GRACE_S = 24.0
"""Time for the supervisor to store its last steps and stop Ray.

Together with the grace of the API's requests, the service ends within half a minute.
"""

START_S = 300.0
"""Longest time until the first heartbeat: a start may wait for each node of a cluster."""

AGAIN_AND_AGAIN = 3
"""Short lives in a row after which a restart is not expected to help."""


@dataclass(frozen=True)
class Silence:
    """How long a supervisor process may go without a heartbeat.

    Attributes:
        told_s: before the silence is reported.
        killed_s: before the process is killed. It is longer than any call may wait for a database that is in use.
        start_s: before the first heartbeat.
    """

    told_s: float = 30.0
    killed_s: float = 30.0 + PATIENCE_S
    start_s: float = START_S

    @classmethod
    def of(cls, settings: Settings) -> "Silence":
        """Return how long a supervisor with this length of lease may go without a heartbeat."""
        return cls(told_s=settings.lease_s, killed_s=settings.lease_s + PATIENCE_S)


class SupervisorProcess:
    """A supervisor that is restarted when it dies or hangs, after a pause that doubles while it keeps dying.

    Args:
        environment: variables for the process.
        module: that runs as `python -m MODULE serve`.
        silence: how long it may go without a heartbeat; left out: as with the default lease.
        store: where the work of a supervisor that died is queued again; None leaves it until its lease ends.
        long_life_s: one that lived longer is restarted after the shortest pause: its start succeeded.
        longest_pause_s: together with the start of Ray, the service recovers within a minute.
    """

    def __init__(
        self,
        environment: Mapping[str, str],
        module: str = "gaplab.workers",
        *,
        silence: Silence | None = None,
        store: Store | None = None,
        long_life_s: float = 15.0,
        longest_pause_s: float = 30.0,
    ) -> None:
        self._environment = environment
        self._module = module
        self._silence = silence or Silence()
        self._store = store
        self._long_life_s, self._longest_pause_s = long_life_s, longest_pause_s
        self._stopping = Event()
        self._short_lives = 0
        self._end: str | None = None
        self._silence_s, self._told = 0.0, ""
        self._thread = Thread(target=self._keep_running, name="supervisor process", daemon=True)

    def start(self) -> None:
        """Start the supervisor, and restart it whenever it dies."""
        self._thread.start()

    def stop(self) -> None:
        """End the supervisor in order."""
        self._stopping.set()
        self._thread.join()

    @property
    def trouble(self) -> str | None:
        """Why nothing runs now; None if the supervisor is well, or is expected to be soon."""
        if self._short_lives >= AGAIN_AND_AGAIN:
            return f"the supervisor ended {self._short_lives} times in a row, and is started again: {self._end}"
        if self._silence_s > self._silence.told_s:
            left_s = self._silence.killed_s - self._silence_s
            return (
                f"the supervisor has not answered for {self._silence_s:.0f} s; if it stays silent, "
                f"it is killed and started again in {max(left_s, 0):.0f} s"
            )
        return f"the supervisor waits: {self._told}" if self._told else None

    @property
    def warning(self) -> str | None:
        """Why experiments wait a moment; None if they do not."""
        return f"the supervisor is started again: {self._end}" if self._end else None

    def _keep_running(self) -> None:
        pause_s = 1.0
        while not self._stopping.is_set():
            began = monotonic()
            self._run_once()
            if self._stopping.is_set():
                return
            lived_long = monotonic() - began > self._long_life_s
            self._short_lives = 1 if lived_long else self._short_lives + 1
            pause_s = 1.0 if lived_long else min(2 * pause_s, self._longest_pause_s)
            log.warning("the supervisor ended by itself (%s); another starts in %.0f s", self._end, pause_s)
            self._stopping.wait(pause_s)

    def _run_once(self) -> None:
        """Run one supervisor until it ends, hangs, or is told to end."""
        reading, writing = os.pipe()
        heard, began = Heard(reading), monotonic()
        environment = {**self._environment, VARIABLE: str(writing)}
        process = start(self._module, "serve", environment=environment, keep_open=(writing,))
        os.close(writing)
        try:
            while process.poll() is None and not self._stopping.wait(0.2):
                self._listen(heard, process, began)
            heard.silence_s()
            if self._stopping.is_set():
                end(process, patience_s=GRACE_S)
            else:
                self._bury(process, heard)
        finally:
            heard.close()

    def _listen(self, heard: Heard, process: "subprocess.Popen[bytes]", began: float) -> None:
        """Take what the supervisor says, and kill it if it says nothing for too long."""
        silence_s = heard.silence_s()
        self._silence_s, self._told = silence_s if heard.begun else 0.0, heard.trouble
        if heard.begun and monotonic() - began > self._long_life_s:
            self._short_lives, self._end = 0, None
        if silence_s > (self._silence.killed_s if heard.begun else self._silence.start_s):
            heard.reason = f"it did not answer for {silence_s:.0f} s, and was killed"
            kill(process)

    def _bury(self, process: "subprocess.Popen[bytes]", heard: Heard) -> None:
        """End what the supervisor left, note why it ended, and queue its work again."""
        kill(process)
        self._silence_s, self._told = 0.0, ""
        self._end = f"exit code {process.returncode}" + (f": {heard.reason}" if heard.reason else "")
        if heard.owner and self._store:
            with suppress(StoreUnavailable):  # then its leases will run out
                supervisors.release(self._store, heard.owner, f"its supervisor ended: {self._end}")
