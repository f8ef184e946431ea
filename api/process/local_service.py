"""A service of one's own: on a free port of this machine, for as long as it is wanted."""

import socket
import subprocess
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import IO

from gaplab.api.clients.client import Client
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.process.child_process import end, start
from gaplab.services.access import authenticate
from gaplab.services.core.errors import Unauthenticated
from gaplab.services.plugins.folders import VARIABLE
from gaplab.services.store.session import Store

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
    with log.open("ab") as output:
        process, url = _started(database_url, output, workers=workers)
        try:
            _wait_until_ready(url, process, log)
            with Client(url, token=_token(database_url)) as client:
                yield client
        finally:
            end(process)


class LocalService(Client):
    """A client of a service that `local_service` started; closing it ends the service."""

    def __init__(self, url: str, process: "subprocess.Popen[bytes]", token: str | None) -> None:
        super().__init__(url, token=token)
        self._process = process

    def close(self) -> None:
        """Close the connection, and end the service in order; what it has computed is kept."""
        super().close()
        end(self._process)


def local_service(folder: str | Path = "results/local", *, plugins: str | Path | None = None) -> LocalService:
    """A service on this machine, with its workers, and the client of it; it ends when that is closed, or with Python.

    Args:
        folder: for its database and its log; made if it is not there. A later service there goes on with both.
        plugins: a folder with plug-ins of one's own; left out: GAPLAB_PLUGINS.

    Raises:
        CommandError: it does not start; the message says why.
    """
    home = Path(folder).absolute()
    home.mkdir(parents=True, exist_ok=True)
    log = home / "service.log"
    database_url = f"sqlite:///{home / 'gaplab.db'}"
    added = {} if plugins is None else {VARIABLE: str(Path(plugins).absolute())}
    with log.open("ab") as output:
        process, url = _started(database_url, output, added)
    try:
        _wait_until_ready(url, process, log)
        return LocalService(url, process, _token(database_url))
    except BaseException:
        end(process)
        raise


def _started(
    database_url: str, log: IO[bytes], added: Mapping[str, str] = MappingProxyType({}), *, workers: bool = True
) -> tuple["subprocess.Popen[bytes]", str]:
    """A service's process, and where it will answer."""
    port = _free_port()
    environment = {"GAPLAB_DATABASE_URL": database_url, "GAPLAB_PORT": str(port), "GAPLAB_HOST": "127.0.0.1"}
    module = ("gaplab", "serve") if workers else ("gaplab.api",)
    process = start(*module, environment=environment | dict(added), log=log)
    return process, f"http://127.0.0.1:{port}"


def _wait_until_ready(url: str, process: "subprocess.Popen[bytes]", log: Path) -> None:
    deadline = time.monotonic() + START_WITHIN_S
    with Client(url, token="") as client:
        while not client.ready():
            if process.poll() is not None or time.monotonic() > deadline:
                msg = f"the service does not start: {_last_line(log)} ({log} says more)"
                raise CommandError(msg, Exit.FAILED)
            time.sleep(0.2)


def _token(database_url: str) -> str | None:
    """None, for GAPLAB_TOKEN, where the database knows tokens; else "", for that one would admit nobody there."""
    store = Store(database_url)
    try:
        authenticate(store, None, required=False)
    except Unauthenticated:
        return None
    finally:
        store.dispose()
    return ""


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    return port


def _last_line(log: Path) -> str:
    lines = log.read_text("utf-8", "replace").strip().splitlines()
    return lines[-1] if lines else "it says nothing"
