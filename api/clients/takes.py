"""The take of a request: kept by heartbeats, and known to be lost before others may move the robot."""

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread

from gaplab.api.clients.connection import Connection, segment
from gaplab.api.clients.errors import ServiceError, ServiceUnreachable, is_final, is_of_gaplab
from gaplab.api.clients.journal import PAUSE_S, log
from gaplab.schemas.measurements import RequestRead

LEASE_SHARE = 0.8
"""Part of a lease after which a take without a heartbeat is lost: the robot stops before others may move it."""


def _now() -> float:
    """Return seconds of a clock that nobody sets, and that goes on while a laptop sleeps."""
    return time.clock_gettime(getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC))


class TakeLost(Exception):
    """Others may move the robot, now or soon: it must stand still, and nothing is measured."""


class Take:
    """The right to measure a request: its constructor takes it, and heartbeats keep it.

    Attributes:
        request: what was taken.
        refused: why the service has ended the take; None if it has not.
        over: is set once it is answered, released, or left to its lease, so that no heartbeat is due.

    Raises:
        ServiceError: somebody else was faster, or the request is no longer needed.
    """

    def __init__(self, connection: Connection, request: str, operator: str, lease_s: float) -> None:
        self._connection, self._path = connection, f"/requests/{segment(request)}"
        self._operator, self._lease_s, self._shown = operator, lease_s, _now()
        body = {"operator": operator, "lease_s": lease_s}
        self.request = connection.post(RequestRead, f"{self._path}/take", body)
        self.refused: str | None = None
        self.over = Event()

    @property
    def lost(self) -> str | None:
        """Why others may move the robot, now or soon; None if they may not."""
        silence_s = LEASE_SHARE * self._lease_s
        if self.refused is None and _now() - self._shown > silence_s:
            return f"no heartbeat has reached the service for {silence_s:g} s"
        return self.refused

    def ask(self) -> None:
        """Send a heartbeat before the robot moves; raise TakeLost if others may move it, now or soon."""
        if not self.lost:
            self._show()
        if self.lost:
            raise TakeLost(self.lost)

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Send heartbeats from another thread, until the take is over or lost; then release what is not over."""
        thread = Thread(target=self._beat, name="heartbeat", daemon=True)
        thread.start()
        try:
            yield
        finally:
            if not self.over.is_set():
                self.release()
            thread.join()

    def release(self) -> None:
        """End the take. If others may have had the robot already, the service is told until it has heard."""
        self.over.set()
        while True:
            try:
                self._let_go()
                return
            except (ServiceError, ServiceUnreachable) as error:
                if is_final(error) or not self._may_overlap:
                    return
                log.warning("not told yet that others may have had the robot: %s", error)
                time.sleep(PAUSE_S)

    def leave(self) -> None:
        """Leave the take of a robot that may still move to its lease; if others may have it already, tell so."""
        self.over.set()
        if self._may_overlap:
            with suppress(ServiceError, ServiceUnreachable):
                self._let_go()

    @property
    def _may_overlap(self) -> bool:
        return self.refused is not None or _now() - self._shown > self._lease_s

    def _let_go(self) -> None:
        self._send("release", moved_s=_now() - self._shown, operator=self._operator)

    def _beat(self) -> None:
        while not self.over.wait(self._lease_s / 3) and not self.lost:
            self._show()

    def _show(self) -> None:
        now = _now()
        try:
            self._send("heartbeat")
        except (ServiceError, ServiceUnreachable) as error:
            log.warning("no heartbeat: %s", error)
            if is_of_gaplab(error) and is_final(error):
                self.refused = str(error)
        else:
            self._shown = now

    def _send(self, verb: str, **told: object) -> None:
        body, timeout_s = {"take": self.request.takes, **told}, max(1.0, self._lease_s / 3)
        self._connection.change(RequestRead, "POST", f"{self._path}/{verb}", json=body, timeout=timeout_s)
