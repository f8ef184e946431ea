"""The API as a process."""

import signal
import socket
import sys

import uvicorn

from gaplab.api.app import create_app
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.services.access import demand_token_beyond_loopback
from gaplab.services.plugins import folders
from gaplab.services.settings import Limits, Settings
from gaplab.services.store.session import Store

GRACE_S = 5
"""How long requests that are under way may take when the service ends."""


def listen(host: str, port: int) -> socket.socket:
    """The address to serve on, taken.

    Raises:
        CommandError: it cannot be had; most often because a service has it already.
    """
    if not 0 <= port < 2**16:
        msg = f"cannot serve on {host}:{port}: ports go from 0 to {2**16 - 1}"
        raise CommandError(msg, Exit.FAILED)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as error:
        reason = str(error.strerror or error).split(" (while")[0]
        msg = f"cannot serve on {host}:{port}: {reason.lower()}"
        raise CommandError(msg, Exit.FAILED) from error


def serve_api(settings: Settings, listener: socket.socket) -> None:
    """Serve until told to stop (SIGINT, SIGTERM); requests under way are answered first. Then the process exits.

    Raises:
        Unauthenticated: the host is more than loopback, and no token lets anyone in.
        StoreUnavailable: the database cannot tell.
        PluginBroken: a plug-in from outside cannot be used.
    """
    end_in_order()
    folders.load()
    refuse_strangers(settings)
    store, limits = Store(settings.database_url), Limits.from_environment()
    try:
        config = uvicorn.Config(
            create_app(store, settings, limits),
            log_config=None,
            server_header=False,
            timeout_graceful_shutdown=GRACE_S,
        )
        Server(config).run([listener])
    finally:
        store.dispose()


def refuse_strangers(settings: Settings) -> None:
    """Do nothing if only this machine reaches the host, or a token lets someone in.

    Raises:
        Unauthenticated: neither; the message has the command that makes one.
        StoreUnavailable: the database cannot tell.
    """
    store = Store(settings.database_url)
    try:
        demand_token_beyond_loopback(store, settings.host)
    finally:
        store.dispose()


class Server(uvicorn.Server):
    """Uvicorn, that ends event streams when it is told to stop: it would wait for them for ever."""

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the streams and the physics, answer the requests under way, and close."""
        self.config.app.state.feed.close()
        self.config.app.state.rollout_process.close()
        await super().shutdown(sockets)


def end_in_order() -> None:
    """Let SIGINT and SIGTERM unwind this process, so that what it opened is closed and what it started is ended."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: sys.exit(0))
