"""The take of a request: kept by signs of life, and known to be lost before others may drive the robot."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread

from gaplab.api.clients.connection import Connection, segment
from gaplab.api.clients.errors import ServiceError, ServiceUnreachable, is_final, is_of_gaplab
from gaplab.api.clients.journal import PAUSE_S, log
from gaplab.schemas.measurements import RequestRead

LEASE_SHARE = 0.8
"""Part of a lease after which a take without a sign of life is lost: the robot stops before others may move it."""


class TakeLost(Exception):
    """Others may drive the robot, now or soon: it must stand still, and nothing is measured."""


def take(connection: Connection, request: str, operator: str, lease_s: float) -> "Take":
    """Take a request.

    Raises:
        ServiceError: it does not exist, somebody else was faster, or it is wanted no more.
    """
    body, since = {"operator": operator, "lease_s": lease_s}, time.monotonic()
    taken = connection.post(RequestRead, f"/requests/{segment(request)}/take", body)
    return Take(connection, taken, lease_s, since)


class Take:
    """A take of a request.

    Attributes:
        request: what was taken.
        over: is set once it is answered, released, or left to its lease, so that no sign of life is due.
        refused: why the service has ended it; None if it has not.
    """

    def __init__(self, connection: Connection, request: RequestRead, lease_s: float, since: float) -> None:
        self.request, self.over = request, Event()
        self.refused: str | None = None
        self._connection, self._lease_s, self._shown = connection, lease_s, since
        self._path, self._body = f"/requests/{segment(request.id)}", {"take": request.takes}

    @property
    def lost(self) -> str | None:
        """Why others may drive the robot, now or soon; None if they may not."""
        silence_s = LEASE_SHARE * self._lease_s
        if self.refused is None and time.monotonic() - self._shown > silence_s:
            return f"no sign of life has reached the service for {silence_s:g} s"
        return self.refused

    def ask(self) -> None:
        """Show a sign of life, before the robot moves.

        Raises:
            TakeLost: others may drive the robot, now or soon.
        """
        if not self.lost:
            self._show()
        if self.lost:
            raise TakeLost(self.lost)

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Show signs of life from another thread, until the take is over or lost."""
        thread = Thread(target=self._beat, name="heartbeat", daemon=True)
        thread.start()
        try:
            yield
        finally:
            self.over.set()
            thread.join()

    def release(self) -> None:
        """End the take. If others may have had the robot before this, the service is told until it has heard."""
        self.over.set()
        while True:
            silence_s = time.monotonic() - self._shown
            moved = {"moved_s": silence_s} if self.refused or silence_s > self._lease_s else {}
            try:
                self._send("release", self._body | moved)
            except (ServiceError, ServiceUnreachable) as error:
                if not moved or is_final(error):
                    return
                log.warning("not told yet that others may have had the robot: %s", error)
                time.sleep(PAUSE_S)
            else:
                return

    def _beat(self) -> None:
        while not self.over.wait(self._lease_s / 3) and not self.lost:
            self._show()

    def _show(self) -> None:
        now = time.monotonic()
        try:
            self._send("heartbeat", self._body)
        except (ServiceError, ServiceUnreachable) as error:
            log.warning("no heartbeat: %s", error)
            if is_of_gaplab(error) and is_final(error):
                self.refused = str(error)
        else:
            self._shown = now

    def _send(self, verb: str, body: dict[str, float]) -> None:
        path, timeout_s = f"{self._path}/{verb}", max(1.0, self._lease_s / 3)
        self._connection.change(RequestRead, "POST", path, json=body, timeout=timeout_s)
