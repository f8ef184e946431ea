"""The API as a process."""

import signal
import socket
import sys
from asyncio import TimerHandle, Transport
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType
from typing import Any

import h11
import uvicorn
from fastapi import FastAPI
from uvicorn.protocols.http.h11_impl import H11Protocol

from gaplab.api.app import create_app
from gaplab.api.process.errors import CommandError
from gaplab.api.process.supervisor_process import SupervisorProcess
from gaplab.services.access import demand_token_beyond_loopback
from gaplab.services.notifications.delivery import Courier
from gaplab.services.plugins import folders
from gaplab.services.settings import Limits, Notify, Settings
from gaplab.services.store.session import Store
from gaplab.services.store.sqlite_file import in_use

_OF_TCP = {socket.AF_INET, socket.AF_INET6}

_TOO_LATE = b"HTTP/1.1 408 Request Timeout\r\nconnection: close\r\ncontent-length: 0\r\n\r\n"


class TimedConnection(H11Protocol):
    """A connection with deadlines. Beyond `limit_concurrency` connections, a new one takes the place of an idle one.

    The idle one is the one that has waited longest for a request to be complete. If there is none, the new one is
    closed: the application itself refuses requests before it comes to that.

    Attributes:
        request_s: time for a request to arrive, besides the time of its body at `slowest_bytes_per_s`.
        slowest_bytes_per_s: pace at which a body must arrive.
        take_s: time for a client to take the part of an answer that was sent to it.
    """

    request_s = 20.0
    slowest_bytes_per_s = 10_000.0
    take_s = 120.0

    def __init__(self, *args: Any, **kwargs: Any) -> None:  # noqa: ANN401 - as the base takes them
        super().__init__(*args, **kwargs)
        self._most, self.limit_concurrency = self.limit_concurrency, None
        self._request_timer: TimerHandle | None = None
        self._answer_timer: TimerHandle | None = None
        self._began = self.loop.time()
        self._arrived = 0

    @property
    def idle(self) -> bool:
        """Whether no request is being served: its head has not arrived."""
        return self.conn.their_state is h11.IDLE and (self.cycle is None or self.cycle.response_complete)

    def connection_made(self, transport: Transport) -> None:  # type: ignore[override]
        """Begin to wait for a request.

        Head and body of an answer leave at once: the body would else wait for the client to confirm the head, which it
        does after 40 ms. asyncio only sees to that for sockets that name their protocol.
        """
        super().connection_made(transport)
        connection = transport.get_extra_info("socket")
        if connection is not None and connection.family in _OF_TCP:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._await_request()
        if self._most is not None and len(self.connections) > self._most:
            self._make_room()

    def connection_lost(self, exc: Exception | None) -> None:
        """Cancel the deadlines of the connection."""
        self._stop_request_timer()
        self.resume_writing()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take a part of a request, and wait for the next part if there is one."""
        self._arrived += len(data)
        super().data_received(data)
        if self.conn.their_state not in {h11.IDLE, h11.SEND_BODY}:
            self._stop_request_timer()
        elif self._request_timer is None:
            self._await_request(len(data))

    def pause_writing(self) -> None:
        """Begin to wait for the client to take a part of the answer."""
        super().pause_writing()
        self._answer_timer = self.loop.call_later(self.take_s, self.transport.abort)

    def resume_writing(self) -> None:
        """Go on with the answer."""
        if self._answer_timer is not None:
            self._answer_timer.cancel()
            self._answer_timer = None
        super().resume_writing()

    def _await_request(self, arrived: int = 0) -> None:
        self._began, self._arrived = self.loop.time(), arrived
        self._request_timer = self.loop.call_later(self.request_s, self._check_request)

    def _stop_request_timer(self) -> None:
        if self._request_timer is not None:
            self._request_timer.cancel()
            self._request_timer = None

    def _check_request(self) -> None:
        """Disconnect a client whose request has not arrived in time, unless the service itself takes no more of it."""
        if self.transport.is_closing():
            return
        if self.flow.read_paused or (self.cycle is not None and self.cycle.waiting_for_100_continue):
            self._await_request()
            return
        left_s = self._began + self.request_s + self._arrived / self.slowest_bytes_per_s - self.loop.time()
        if left_s > 0:
            self._request_timer = self.loop.call_later(left_s, self._check_request)
            return
        if self.idle and self._arrived:
            self.transport.write(_TOO_LATE)
        self.transport.close()

    def _make_room(self) -> None:
        self.logger.warning("more than %d connections are open: those that send no request are closed", self._most)
        connections = (each for each in self.connections if isinstance(each, TimedConnection))
        others = (each for each in connections if each is not self and each.idle)
        closed = min(others, key=lambda each: each._began, default=self)
        self.connections.discard(closed)
        closed.transport.abort()


GRACE_S = 5
"""Time that requests under way have to finish when the service ends."""

KEPT_S = 60
"""Time for which an idle connection is kept: longer than clients keep theirs, httpx for 5 s, since one that is closed
while its client sends loses the request."""

BACKLOG = 256
"""Connections that are taken at once, before any of them counts."""


def listen(host: str, port: int) -> socket.socket:
    """Return a listening socket.

    Raises:
        CommandError: the address is invalid or taken, most often by a service that already runs.
    """
    if not 0 <= port < 2**16:
        raise CommandError(f"cannot serve on {host}:{port}: ports go from 0 to {2**16 - 1}")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as error:
        reason = str(error.strerror or error).split(" (while")[0]
        raise CommandError(f"cannot serve on {host}:{port}: {reason.lower()}") from error


def serve_api(
    settings: Settings,
    listener: socket.socket,
    supervisor: SupervisorProcess | None = None,
    *,
    limits: Limits | None = None,
    notify: Notify | None = None,
) -> None:
    """Serve until SIGINT, SIGTERM or SIGHUP, then finish the requests under way.

    `/readyz` tells the troubles of the supervisor. Limits and notifications that are left out are the environment's.

    Raises:
        Unauthenticated: other machines can reach the host, and no token exists.
        StoreUnavailable: the database does not answer.
        ValueError: a limit or a setting of notifications is not permitted.
    """
    limits, notify = limits or Limits.from_environment(), notify or Notify.from_environment()
    exit_on_signals()
    folders.load(warn=True)
    require_token(settings)
    with Store(settings.database_url) as store, in_use(store.file):
        app = create_app(store, settings, limits, notify)
        app.state.supervisor, app.state.lease_s = supervisor, settings.lease_s
        with Courier(store, notify, settings.url):
            Server(app).run([listener])


def require_token(settings: Settings) -> None:
    """Raise Unauthenticated, with the command that creates one, if other machines reach the host without a token."""
    with Store(settings.database_url) as store:
        demand_token_beyond_loopback(store, settings.host)


class Server(uvicorn.Server):
    """Uvicorn that ends event streams at shutdown, rather than waiting for them forever."""

    def __init__(self, app: FastAPI, connection: type[TimedConnection] = TimedConnection) -> None:
        config = uvicorn.Config(
            app,
            http=connection,
            limit_concurrency=app.state.connections,
            backlog=BACKLOG,
            timeout_keep_alive=KEPT_S,
            log_config=None,
            server_header=False,
            timeout_graceful_shutdown=GRACE_S,
        )
        super().__init__(config)
        self._app = app

    @contextmanager
    def capture_signals(self) -> Generator[None, None, None]:
        """Take signals from now on; one that came before, and whose exception was lost, counts too."""
        with super().capture_signals():
            self.should_exit = self.should_exit or bool(_came)
            yield

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the streams and the replay process, finish the requests under way, and close."""
        self._app.state.feed.close()
        self._app.state.rollout_process.close()
        await super().shutdown(sockets)


_came: list[int] = []
"""Signals so far that were turned into SystemExit."""


def exit_on_signals() -> None:
    """Turn SIGINT and SIGTERM into SystemExit, so that `finally` blocks close what is open; a lost terminal too.

    Python drops an exception that is raised while it frees an object, so a `Server` asks which signals came.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _leave)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as `nohup` sets it
        signal.signal(signal.SIGHUP, lambda *_: signal.raise_signal(signal.SIGTERM))


def _leave(number: int, _: FrameType | None) -> None:
    _came.append(number)
    sys.exit(0)
