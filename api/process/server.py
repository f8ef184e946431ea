"""The API as a process."""

import signal
import socket
import sys

import uvicorn
from fastapi import FastAPI

from gaplab.api.app import create_app
from gaplab.api.process.connections import TimedConnection
from gaplab.api.process.errors import CommandError
from gaplab.api.process.supervisor_process import SupervisorProcess
from gaplab.services.access import demand_token_beyond_loopback
from gaplab.services.notifications.courier import courier
from gaplab.services.plugins import folders
from gaplab.services.settings import Limits, Notify, Settings
from gaplab.services.store.session import Store
from gaplab.services.store.sqlite_file import in_use

GRACE_S = 5
"""Time that requests under way have to finish when the service ends."""

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
    """Serve until SIGINT or SIGTERM, then finish the requests under way.

    Args:
        settings: of the service.
        listener: where requests come in.
        supervisor: that this process keeps, whose troubles `/readyz` tells.
        limits: left out: those of the environment.
        notify: settings of notifications; left out: those of the environment.

    Raises:
        Unauthenticated: other machines can reach the host, and no token exists.
        StoreUnavailable: the database does not answer.
        ValueError: a limit or a setting of notifications is not permitted.
    """
    limits, notify = limits or Limits.from_environment(), notify or Notify.from_environment()
    exit_on_signals()
    folders.load()
    require_token(settings)
    store = Store(settings.database_url)
    try:
        with in_use(store.file):
            app = create_app(store, settings, limits, notify)
            app.state.supervisor, app.state.lease_s = supervisor, settings.lease_s
            with courier(store, notify, settings.url):
                Server(app).run([listener])
    finally:
        store.dispose()


def require_token(settings: Settings) -> None:
    """Check that a token exists if other machines can reach the host.

    Raises:
        Unauthenticated: none does; the message has the command that creates one.
        StoreUnavailable: the database does not answer.
    """
    store = Store(settings.database_url)
    try:
        demand_token_beyond_loopback(store, settings.host)
    finally:
        store.dispose()


class Server(uvicorn.Server):
    """Uvicorn that ends event streams at shutdown, rather than waiting for them forever.

    Args:
        app: to serve.
        connection: class of its connections.
    """

    def __init__(self, app: FastAPI, connection: type[TimedConnection] = TimedConnection) -> None:
        config = uvicorn.Config(
            app,
            http=connection,
            limit_concurrency=app.state.connections,
            backlog=BACKLOG,
            log_config=None,
            server_header=False,
            timeout_graceful_shutdown=GRACE_S,
        )
        super().__init__(config)
        self._app = app

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the streams and the replay process, finish the requests under way, and close."""
        self._app.state.feed.close()
        self._app.state.rollout_process.close()
        self._app.state.drawing_process.close()
        await super().shutdown(sockets)


def exit_on_signals() -> None:
    """Turn SIGINT and SIGTERM into SystemExit, so that `finally` blocks close what is open."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: sys.exit(0))
