"""The two databases on a small disk, and what can be done to each."""

import os
import shutil
import signal
import sqlite3
import subprocess
import time
from contextlib import suppress
from datetime import timedelta
from pathlib import Path
from typing import Any

import psycopg
from sqlalchemy import select

from gaplab.services.store.models import RepetitionRow, SensitivityRow, SupervisorRow
from gaplab.services.store.session import Store
from tests.postgres import PORT, Installation, answers, url
from tests.proxy import Proxy
from tests.soak.stage import Kept, send
from tests.waiting import wait_until

CLOCK_JUMP = timedelta(hours=1)


def _shift_heartbeats(url: str, by: timedelta) -> bool:
    store = Store(url)
    try:
        with store.transaction() as session:
            models: tuple[Any, ...] = (RepetitionRow, SensitivityRow, SupervisorRow)
            for model in models:
                for row in session.scalars(select(model).where(model.heartbeat_at.is_not(None))).all():
                    row.heartbeat_at += by
        return True
    finally:
        store.dispose()


class SmallDisk:
    """A tmpfs of its own size, so that it can be filled; a plain folder where mounting is not permitted.

    Attributes:
        folder: what is on it.
        small: whether it can be filled.
    """

    def __init__(self, folder: Path, mebibytes: Any) -> None:
        self.folder = Path(folder)
        self.folder.mkdir()
        mount = ["mount", "-t", "tmpfs", "-o", f"size={mebibytes}m,mode=755", "gaplab-soak", str(self.folder)]
        self.small = os.geteuid() == 0 and subprocess.run(mount, capture_output=True).returncode == 0

    def fill(self) -> None:
        """Take all the room that is left."""
        with (self.folder / "filler").open("ab", buffering=0) as filler, suppress(OSError):
            while True:
                filler.write(b"\0" * 4096)

    def free(self) -> None:
        """Give the room back."""
        (self.folder / "filler").unlink(missing_ok=True)

    def remove(self) -> None:
        if self.small:
            subprocess.run(["umount", "--lazy", str(self.folder)], check=True)


class Sqlite:
    """A SQLite file."""

    name = "SQLite"

    def __init__(self, folder: Path) -> None:
        self.disk = SmallDisk(Path(folder) / "disk", 256)
        self._file = self.disk.folder / "gaplab.db"
        self._backup = Path(folder) / "backup.db"
        self.url = self.url_of_service = f"sqlite:///{self._file}"

    def stall(self, seconds: Any) -> None:
        """Hold the exclusive lock for seconds: a disk on which a commit takes so long."""
        connection = sqlite3.connect(self._file, isolation_level=None, timeout=60)
        try:
            connection.execute("BEGIN EXCLUSIVE")
            time.sleep(seconds)
            connection.execute("ROLLBACK")
        finally:
            connection.close()

    def set_clock(self, by: timedelta) -> bool:
        """Let all holders' heartbeats have been given before the clock was set."""
        return _shift_heartbeats(self.url, -by)

    def restore(self, stage: Any, meanwhile: Any) -> None:
        """Back up, end the service some time later, restore the backup, and start the service again."""
        stage.command("backup", self._backup)
        meanwhile()
        with stage.resting():
            stage.command("restore", self._backup)
        self._backup.unlink()
        for former in self.disk.folder.glob("*.replaced-*"):
            former.unlink()

    def complaints(self) -> Any:
        """What the database's own check of its file finds."""
        connection = sqlite3.connect(self._file)
        found = [row[0] for row in connection.execute("PRAGMA integrity_check")]
        found += [f"foreign key: {row}" for row in connection.execute("PRAGMA foreign_key_check")]
        connection.close()
        return [each for each in found if each != "ok"]

    def close(self) -> None:
        self.disk.remove()


class Postgres:
    """A real server, from a wheel, started again by a service manager whenever it ends."""

    name = "Postgres"

    def __init__(self, folder: Path) -> None:
        folder = Path(folder)
        self.disk = SmallDisk(folder / "disk", 512)
        installation, data = Installation(folder), self.disk.folder / "data"
        installation.initialise(data)
        self.url, self._data, self._backup = url(data), data, folder / "backup"
        self._proxy = Proxy(f"{data}/.s.PGSQL.{PORT}")
        self.url_of_service = f"postgresql://postgres@127.0.0.1:{self._proxy.port}/postgres"
        command = installation.command(data, max_wal_size="64MB", min_wal_size="32MB")
        self._kept = Kept(command, folder / "postgres.log", user=installation.user)
        self._wait()

    def restart(self) -> None:
        """An orderly restart that waits for nobody: open transactions are given up."""
        send(self._kept.pid, signal.SIGINT)

    def kill(self) -> None:
        """The server and all that it started, outright."""
        for pid in [self._kept.pid, *self._children()]:
            send(pid, signal.SIGKILL)

    def hang_up(self) -> bool:
        """End every connection of clients; False while the server does not answer."""
        try:
            with psycopg.connect(self.url, autocommit=True) as connection:
                connection.execute(
                    "SELECT pg_terminate_backend(pid) FROM pg_stat_activity "
                    "WHERE backend_type = 'client backend' AND pid <> pg_backend_pid()"
                )
        except psycopg.OperationalError:
            return False
        return True

    def fall_silent(self) -> None:
        """Let every connection of the service die without a word to either side."""
        self._proxy.hang()

    def set_clock(self, by: timedelta) -> bool:
        """Let all holders' heartbeats have been given before the clock was set."""
        return _shift_heartbeats(self.url, -by)

    def restore(self, stage: Any, meanwhile: Any) -> None:
        """Copy the server's files, and some time later put the copy in their place; the service runs all the time."""
        with self._kept.resting():
            subprocess.run(["cp", "--archive", self._data, self._backup], check=True)
        self._wait()
        meanwhile()
        with self._kept.resting():
            shutil.rmtree(self._data)
            subprocess.run(["cp", "--archive", self._backup, self._data], check=True)
        self._wait()
        shutil.rmtree(self._backup)

    def stall(self, seconds: Any) -> None:
        """Stop the server's processes that answer clients: a disk on which their writes take so long."""
        stopped = [pid for pid in self._children() if send(pid, signal.SIGSTOP)]
        try:
            time.sleep(seconds)
        finally:
            for pid in stopped:
                send(pid, signal.SIGCONT)

    def complaints(self) -> Any:
        """What reading every page finds, each of which has its checksum."""
        found = []
        with psycopg.connect(self.url, autocommit=True) as connection:
            names = connection.execute("SELECT oid::regclass::text FROM pg_class WHERE relkind = 'r'").fetchall()
            for (name,) in names:
                try:
                    connection.execute(f"SELECT count(t.*) FROM {name} t")
                except psycopg.Error as error:
                    found.append(f"{name}: {error}")
        return found

    def close(self) -> None:
        self._proxy.close()
        self._kept.stop(signal.SIGINT)
        self.disk.remove()

    def _children(self) -> Any:
        return [
            int(pid)
            for path in Path(f"/proc/{self._kept.pid}/task").glob("*/children")
            for pid in path.read_text().split()
        ]

    def _wait(self) -> None:
        wait_until(lambda: answers(self.url), otherwise=lambda: "Postgres does not answer")
