"""The API as a process."""

import signal
import socket
import sys

import uvicorn

from api.app import create_app
from api.exits import CommandError, Exit
from services.settings import Settings
from services.store.session import Store

GRACE_S = 5
"""How long requests that are under way may take when the service ends."""


def listen(host: str, port: int) -> socket.socket:
    """The address to serve on, taken.

    Raises:
        CommandError: it cannot be had; most often because a service has it already.
    """
    if port >= 2**16:
        msg = f"cannot serve on {host}:{port}: ports end at {2**16 - 1}"
        raise CommandError(msg, Exit.FAILED)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as error:
        reason = str(error.strerror or error).split(" (while")[0]
        msg = f"cannot serve on {host}:{port}: {reason.lower()}"
        raise CommandError(msg, Exit.FAILED) from error


def serve_api(settings: Settings, listener: socket.socket) -> None:
    """Serve until told to stop (SIGINT, SIGTERM); then answer what is asked already, and exit."""
    end_in_order()
    store = Store(settings.database_url)
    try:
        config = uvicorn.Config(
            create_app(store), log_level="warning", server_header=False, timeout_graceful_shutdown=GRACE_S
        )
        uvicorn.Server(config).run([listener])
    finally:
        store.dispose()


def end_in_order() -> None:
    """Let SIGINT and SIGTERM unwind this process, so that what it opened is closed and what it started is ended."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: sys.exit(0))
