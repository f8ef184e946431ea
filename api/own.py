"""A service of one's own: on a free port of this machine, for as long as it is wanted."""

import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from api.client import Client
from api.exits import CommandError, Exit
from api.launch import end, start

START_WITHIN_S = 120.0


@contextmanager
def own_service(database_url: str, log: Path, *, workers: bool = True) -> Iterator[Client]:
    """A client of a real service, a process of its own that is ended in order at the end.

    Args:
        database_url: of its database, which one without workers does not migrate.
        log: gets what it says.
        workers: whether it computes as well as answers.

    Raises:
        CommandError: it does not start.
    """
    port = _free_port()
    environment = {"GAPLAB_DATABASE_URL": database_url, "GAPLAB_PORT": str(port), "GAPLAB_HOST": "127.0.0.1"}
    with log.open("ab") as output:
        module = ("api.cli", "serve") if workers else ("api",)
        process = start(*module, environment=environment, log=output)
        try:
            with Client(f"http://127.0.0.1:{port}") as client:
                deadline = time.monotonic() + START_WITHIN_S
                while not client.ready():
                    if process.poll() is not None or time.monotonic() > deadline:
                        msg = f"the service does not start: {_last_line(log)} ({log} says more)"
                        raise CommandError(msg, Exit.FAILED)
                    time.sleep(0.2)
                yield client
        finally:
            end(process)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    return port


def _last_line(log: Path) -> str:
    lines = log.read_text("utf-8", "replace").strip().splitlines()
    return lines[-1] if lines else "it says nothing"
