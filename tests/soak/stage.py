"""The real service on a database of its own: an API with its supervisor, a second supervisor, each with its Ray.

What runs outside of gaplab in production, a service manager that starts again what has ended, is played by `Kept`.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from tempfile import mkdtemp
from threading import Event, Thread
from typing import Any

import httpx2

from gaplab import migrations
from gaplab.schemas.access import Role
from gaplab.services import access
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.session import Store
from tests.ports import free_port
from tests.soak import witness
from tests.waiting import wait_until

STEP_LIMIT_S = 40
"""In production it is a week; the steps of a soak take seconds, and a worker that takes longer counts as hung."""

PAST_THE_LEASE = 1.5
"""For how many leases a process is stopped."""

PATIENCE_S = 8
"""After which a client gives up on an answer."""

RESTART_S = 1.0
"""After how long a service manager starts again what has ended."""


class Kept:
    """A process that is started again whenever it ends, as systemd or Docker do.

    Attributes:
        pid: of the process that runs now.
    """

    def __init__(self, command: Any, log: Any, environment: Any = None, user: Any = None) -> None:
        self._command, self._log, self._environment, self._user = command, log, environment, user
        self._stopping = Event()
        self._begin()

    @property
    def pid(self) -> Any:
        return self._process.pid

    def stop(self, how: Any = signal.SIGINT, patience_s: Any = 60) -> bool:
        """Ask it to end, and say whether it did; if not, it is killed."""
        self._stopping.set()
        self._thread.join()
        self._process.send_signal(how)
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(patience_s)
            return True
        self._process.kill()
        self._process.wait()
        return False

    @contextmanager
    def resting(self) -> Iterator[None]:
        """End it in order, and start it again at the end of the block."""
        assert self.stop(), f"{self._command} did not end"
        yield
        self._stopping.clear()
        self._begin()

    def _begin(self) -> None:
        self._process = self._start()
        self._thread = Thread(target=self._keep, daemon=True)
        self._thread.start()

    def _keep(self) -> None:
        while not self._stopping.wait(0.1):
            if self._process.poll() is not None and not self._stopping.wait(RESTART_S):
                self._process = self._start()

    def _start(self) -> Any:
        with self._log.open("ab") as log:
            return subprocess.Popen(
                self._command,
                env=self._environment,
                user=self._user,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )


class Stage:
    """Everything that a fault can hit.

    Attributes:
        port, url: of the API.
        http: client with a token of its own, for all that use the service.
        database: Sqlite or Postgres, as in `databases`.
        lease_s: for which a supervisor may be silent.
        plugins: folder of the service's external plug-ins.
        history: of what clients were told, for faults that are requests.
        clients: that use the service.
        journal: of the commands that the robots got.
        complaints: of faults that saw the service say what is not so.
    """

    clients: Any

    def __init__(self, folder: Path, database: Any, lease_s: Any, plugins: Any = None, history: Any = None) -> None:
        self.database, self.lease_s, self.plugins, self.history = database, lease_s, plugins, history
        self._folder = Path(folder)
        self.journal, self.complaints = self._folder / "journal.txt", list[str]()
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self.http = httpx2.Client(base_url=self.url, timeout=PATIENCE_S, trust_env=False)
        self._environment = os.environ | {
            "GAPLAB_DATABASE_URL": database.url_of_service,
            "GAPLAB_SOAK_JOURNAL": str(self.journal),
            "GAPLAB_PORT": str(self.port),
            "GAPLAB_WORKERS": "1",
            "GAPLAB_LEASE_S": str(lease_s),
            "GAPLAB_PLUGINS": str(plugins or ""),
            "GAPLAB_STEP_LIMIT_S": str(STEP_LIMIT_S),
            "RAY_TMPDIR": mkdtemp(prefix="gaplab-"),  # Ray leaves logs behind; the paths of its sockets must be short
        }
        self._kept: list[Any] = []

    def start(self) -> None:
        """Migrate, set the witness, start the processes, and wait until the API answers."""
        migrations.upgrade(self.database.url)
        witness.install(self.database.url)
        self.http.headers["Authorization"] = f"Bearer {self.new_token().secret}"
        for name, module in (("service", "gaplab"), ("second", "gaplab.workers")):
            log = self._folder / f"{name}.log"
            self._kept.append(Kept([sys.executable, "-m", module, "serve"], log, self._environment))
        wait_until(self.answers, otherwise=self.logs)

    def new_token(self) -> Any:
        """A token that may submit and measure, with its secret."""
        made = list[access.NewToken]()
        with Store(self.database.url) as store:
            until(lambda: made.append(access.create_token(store, Role.RUNNER)) or made, 60)  # type: ignore[func-returns-value]
        return made[0]

    def stop(self) -> Any:
        """End all in order; what did not end when asked, and what was left behind, in words."""
        left = [f"{each.pid} did not end within a minute" for each in self._kept if not each.stop()]
        if not until(lambda: not self.processes(), 60):
            left += [f"left running: {pid} {command}" for pid, command in self.processes().items()]
        return left

    @contextmanager
    def resting(self) -> Iterator[None]:
        """End the service's processes in order, and start them again at the end of the block."""
        with ExitStack() as stack:
            for each in self._kept:
                stack.enter_context(each.resting())
            yield

    def command(self, *words: Any) -> None:
        """Run a command of gaplab on the service's database."""
        command = [sys.executable, "-m", "gaplab", *map(str, words)]
        done = subprocess.run(command, env=self._environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    def kill(self) -> None:
        """End what is left outright, and remove what it left."""
        self.http.close()
        for each in self._kept:
            each.stop(signal.SIGKILL)
        for pid in self.processes():
            send(pid, signal.SIGKILL)
        shutil.rmtree(self._environment["RAY_TMPDIR"], ignore_errors=True)

    def answers(self) -> bool:
        """Whether the API answers and can use its database."""
        try:
            return httpx2.get(f"{self.url}/readyz", timeout=5, trust_env=False).status_code == 200
        except httpx2.HTTPError:
            return False

    def processes(self) -> Any:
        """All processes of the service that live, by id, with their commands."""
        mark = f"GAPLAB_PORT={self.port}".encode()
        found: dict[int, str] = {}
        for path in Path("/proc").glob("[0-9]*"):
            try:
                if mark in (path / "environ").read_bytes().split(b"\0"):
                    found[int(path.name)] = (path / "cmdline").read_bytes().replace(b"\0", b" ").decode().strip()
            except OSError:  # it has ended
                continue
        return {pid: command for pid, command in found.items() if command}

    def of(self, role: Any) -> Any:
        """The ids of the processes that play a role: api, supervisor, worker or raylet."""
        return [pid for pid, command in self.processes().items() if role_of(command) == role]

    def memory(self) -> Any:
        """Resident memory of each process in MB, and what the largest one is."""
        found = []
        for pid, command in self.processes().items():
            with suppress(OSError):  # it has ended
                pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
                found.append((pages * os.sysconf("SC_PAGE_SIZE") / 1e6, role_of(command) or command))
        return [size for size, _ in found], max(found)[1]

    def logs(self) -> Any:
        return "\n".join(path.read_text(errors="replace")[-3000:] for path in sorted(self._folder.glob("*.log")))


def role_of(command: Any) -> Any:
    program = command.partition(" ")[0]
    if "-m gaplab serve" in command:
        return "api"
    if "workers serve" in command:
        return "supervisor"
    if command.startswith("ray::"):
        return "worker"
    return "raylet" if program.endswith("/raylet") else None


def send(pid: Any, number: Any) -> bool:
    """A signal to a process, if it is still there."""
    try:
        os.kill(pid, number)
    except ProcessLookupError:
        return False
    return True


def until(condition: Any, within_s: Any, every_s: Any = 0.2) -> bool:
    """Whether the condition came to hold in time; a database that is away does not count as an answer."""
    deadline = time.monotonic() + within_s
    while time.monotonic() < deadline:
        try:
            if condition():
                return True
        except StoreUnavailable:
            pass
        time.sleep(every_s)
    return False
