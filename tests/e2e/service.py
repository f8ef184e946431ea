"""The real service as its users run it: `gaplab serve` as a process, asked over HTTP."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import httpx2

from tests.ports import free_port
from tests.processes import processes, processes_with
from tests.waiting import LONGEST_S, wait_until

STUDY_S = 2_000.0
"""Longest wait for the end of a study."""


class Service:
    """`gaplab serve` on a free port of loopback, with its own database, workers and log.

    Attributes:
        url: where it answers.
        http: a client of it.
    """

    def __init__(
        self, folder: Path, database_url: str | None = None, plugins: Any = "", arguments: tuple[str, ...] = ()
    ) -> None:
        port = free_port()
        self.url = f"http://127.0.0.1:{port}"
        self.http = httpx2.Client(base_url=self.url, timeout=LONGEST_S)
        self._log = folder / "service.log"
        self._environment = os.environ | {
            "GAPLAB_DATABASE_URL": database_url or f"sqlite:///{folder / 'gaplab.db'}",
            "GAPLAB_PORT": str(port),
            "GAPLAB_WORKERS": "2",
            "GAPLAB_LEASE_S": "5",
            "GAPLAB_PLUGINS": str(plugins),
        }
        self._command = [sys.executable, "-m", "gaplab", "serve", *arguments]
        self._process: Any = None

    def start(self) -> Any:
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(self._command, env=self._environment, stdout=log, stderr=log)
        wait_until(self._answers, otherwise=self.log)
        return self

    def stop(self, how: Any = signal.SIGINT) -> None:
        """In order, as Ctrl-C does."""
        self._process.send_signal(how)
        assert self._process.wait(LONGEST_S) == 0, self.log()

    def kill(self) -> None:
        """Everything at once, with no time to say goodbye: the API, the supervisor, Ray and its workers."""
        for pid in [*self.processes(), self._process.pid]:
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
        self._process.wait()

    def kill_repetitions(self) -> None:
        """The processes of Ray that compute repetitions, and nothing else."""
        ours = set(self.processes())
        for pid, command in processes():
            if pid in ours and command.startswith(b"ray::run"):
                os.kill(pid, signal.SIGKILL)

    def processes(self) -> Any:
        """Everything that runs with this service's port in its environment."""
        return processes_with(f"GAPLAB_PORT={self._environment['GAPLAB_PORT']}")

    def log(self) -> Any:
        return self._log.read_text()

    def close(self) -> None:
        self.http.close()
        if self._process and self._process.poll() is None:
            self.stop()

    def get(self, path: Any, **query: Any) -> Any:
        answer = self.http.get(path, params=query)
        assert answer.status_code == 200, answer.text
        return answer.json()

    def post(self, path: Any, body: Any) -> Any:
        answer = self.http.post(path, json=body)
        assert answer.status_code == 202, answer.text
        assert self.get(answer.headers["location"])["id"] == answer.json()["id"]
        return answer.json()

    def finish(self, path: Any) -> Any:
        """The resource at the path, once it has ended."""
        ended = lambda: self.get(path)["state"] not in {"QUEUED", "RUNNING"}  # noqa: E731
        wait_until(ended, within_s=STUDY_S, otherwise=lambda: self.get(path))
        return self.get(path)

    def _answers(self) -> bool:
        try:
            return self.http.get("/readyz").status_code == 200
        except httpx2.TransportError:
            return False
