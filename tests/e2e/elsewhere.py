"""What readers of some documents have and a clone has not: a Postgres of their own, and shells on several machines."""

import os
import shlex
import signal
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import psycopg

from gaplab.api.clients.client import Client
from tests.e2e.reading import ROOT, commands
from tests.ports import free_port
from tests.postgres import Installation, Server
from tests.processes import processes_with
from tests.waiting import wait_until

PASSWORD = "correct-horse"
SERVERS = {"gaplab serve", "python -m workers serve", "python -m api"}
"""Lines that do not end by themselves."""


class Postgres:
    """A server as people run one: on a port, here of loopback, where a user of the network shows a password.

    Attributes:
        host: where it is, as a URL has it.
        environment: by which Postgres' own commands are its administrator's, on its socket.
    """

    def __init__(self, folder: Path) -> None:
        installation = Installation(folder)
        data, port = folder / "readers", free_port()
        installation.initialise(data)
        (data / "pg_hba.conf").write_text("local all all trust\nhost gaplab gaplab 127.0.0.1/32 scram-sha-256\n")
        self.host, self.commands = f"127.0.0.1:{port}", installation.programs
        self.environment = {"PGHOST": str(data), "PGPORT": str(port), "PGUSER": "postgres"}
        self._server = Server(installation, data, listen_addresses="127.0.0.1", port=port, fsync="off")

    def forget(self) -> None:
        """Remove what readers have made."""
        with self._connected() as connection:
            connection.execute("DROP DATABASE IF EXISTS gaplab WITH (FORCE)")
            connection.execute("DROP ROLE IF EXISTS gaplab")

    def stored(self) -> Any:
        """How many experiments are in the database that readers have made."""
        with self._connected("gaplab") as connection:
            return connection.execute("SELECT count(*) FROM experiment").fetchone()[0]

    def close(self) -> None:
        self._server.stop()

    def _connected(self, database: Any = "postgres") -> Any:
        names = {"host": "PGHOST", "port": "PGPORT", "user": "PGUSER"}
        given = {key: self.environment[name] for key, name in names.items()}
        return psycopg.connect(dbname=database, autocommit=True, **given)  # type: ignore[arg-type]


class Shell:
    """A reader's shell: what is exported stays, what serves goes on beside, and all that it started ends with it.

    Attributes:
        home: its user's folder.
        log: what all that it started said.
    """

    def __init__(self, folder: Path, **environment: Any) -> None:
        self.home, self.log = folder / "home", folder / "log"
        self.home.mkdir(parents=True)
        inherited = {name: value for name, value in os.environ.items() if not name.startswith(("RAY_", "GAPLAB_"))}
        path = os.pathsep.join([str(commands(folder)), environment.pop("PATH", ""), inherited["PATH"]])
        self._mark = f"HOME={self.home}"
        self._port = str(free_port())
        own = {"HOME": str(self.home), "PATH": path, "PYTHONPATH": str(ROOT), "GAPLAB_PORT": self._port}
        self._environment = inherited | own | environment

    @contextmanager
    def following(self, lines: Any) -> Iterator[Any]:
        """What a document has its reader do, in its order; a client while that serves, which is then told to end."""
        with ExitStack() as serving:
            for line in lines:
                if line in SERVERS:
                    serving.enter_context(self._serving(line))
                else:
                    self.run(line)
            client = serving.enter_context(Client(f"http://127.0.0.1:{self._port}", token=""))
            wait_until(client.ready, otherwise=self.said)
            yield client

    def run(self, line: Any) -> None:
        """To its end, which must be a good one; who is asked for a password types it, twice."""
        word, *values = shlex.split(line)
        if word == "export":
            self._environment |= dict(value.split("=", 1) for value in values)
            return
        typed = f"{PASSWORD}\n" * 2
        with self.log.open("ab") as log:
            done = subprocess.run(
                ["bash", "-c", line],
                cwd=self.home,
                env=self._environment,
                input=typed.encode(),
                stdout=log,
                stderr=log,
                start_new_session=True,  # without a terminal, passwords are read from standard input
                timeout=120,
                check=False,
            )
        assert done.returncode == 0, f"{line}\n{self.said()}"

    def said(self) -> Any:
        return self.log.read_text(errors="replace")[-6000:]

    def processes(self) -> Any:
        """All that it started and that lives."""
        return processes_with(self._mark)

    def close(self) -> None:
        """End what is left outright, as nodes of a Ray that are asked wait for each other."""
        for pid in self.processes():
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        wait_until(lambda: not self.processes(), otherwise=self.processes)

    @contextmanager
    def _serving(self, line: Any) -> Iterator[None]:
        with self.log.open("ab") as log:
            call = ["bash", "-c", f"exec {line}"]
            process = subprocess.Popen(call, cwd=self.home, env=self._environment, stdout=log, stderr=log)
        try:
            yield
            assert process.poll() is None, f"{line} ended by itself\n{self.said()}"
        finally:
            process.terminate()
            code = process.wait(60)
        assert code == 0, f"{line}: {code}\n{self.said()}"
