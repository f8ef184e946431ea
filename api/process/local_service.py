"""A service on a free port of this machine, and its client."""

import socket
import subprocess
import time
from pathlib import Path

from gaplab.api.clients.client import Client
from gaplab.api.process.child_process import end, start
from gaplab.api.process.errors import CommandError
from gaplab.services.access import Unauthenticated, authenticate
from gaplab.services.plugins.folders import VARIABLE
from gaplab.services.store.atomic_files import private
from gaplab.services.store.session import Store
from gaplab.services.store.sqlite_file import url_of

START_WITHIN_S = 120.0

LARGEST_LOG = 10_000_000
"""Bytes of a log that is continued; a larger one becomes the old log, of which there is one."""


class LocalService(Client):
    """The client of a service that it started; closing it ends the service."""

    def __init__(self, url: str, process: "subprocess.Popen[bytes]", token: str | None) -> None:
        super().__init__(url, token=token)
        self._process = process

    def close(self) -> None:
        """Close the connection and end the service in order; its results are kept."""
        super().close()
        end(self._process)


def local_service(folder: str | Path = "results/local", *, plugins: str | Path | None = None) -> LocalService:
    """Start a service with workers on this machine and return its client; it ends when closed, or with Python.

    Args:
        folder: folder of the database and the log, created if absent; a later service in it continues with both.
        plugins: a folder with your own plug-ins; left out: GAPLAB_PLUGINS.

    Raises:
        CommandError: the service does not start; the message says why.
    """
    home = Path(folder).absolute()
    home.mkdir(parents=True, exist_ok=True)
    return start_service(url_of(home / "gaplab.db"), home / "service.log", plugins=plugins)


def start_service(
    database_url: str, log: Path, *, workers: bool = True, plugins: str | Path | None = None
) -> LocalService:
    """Start a service as `local_service` does; without workers, it runs no experiments and migrates nothing."""
    port = _free_port()
    url = f"http://127.0.0.1:{port}"
    environment = {"GAPLAB_DATABASE_URL": database_url, "GAPLAB_PORT": str(port), "GAPLAB_HOST": "127.0.0.1"}
    if plugins is not None:
        environment[VARIABLE] = str(Path(plugins).absolute())
    if log.exists() and log.stat().st_size > LARGEST_LOG:
        log.replace(log.with_name(f"{log.name}.old"))
    with open(log, "ab", opener=private) as output:
        process = start(*(("gaplab", "serve") if workers else ("gaplab.api",)), environment=environment, log=output)
    try:
        _wait_until_ready(url, process, log)
        return LocalService(url, process, token_of(database_url))
    except BaseException:
        end(process)
        raise


def _wait_until_ready(url: str, process: "subprocess.Popen[bytes]", log: Path) -> None:
    deadline = time.monotonic() + START_WITHIN_S
    with Client(url, token="") as client:
        while not client.ready():
            if process.poll() is not None or time.monotonic() > deadline:
                lines = log.read_text("utf-8", "replace").strip().splitlines() or ["its log is empty"]
                raise CommandError(f"the service does not start: {lines[-1]} ({log} says more)")
            time.sleep(0.2)


def token_of(database_url: str) -> str | None:
    """Return None, for GAPLAB_TOKEN, if the database has tokens; else "", because it would refuse any token."""
    with Store(database_url) as store:
        try:
            authenticate(store, None, required=False)
        except Unauthenticated:
            return None
    return ""


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    return port
