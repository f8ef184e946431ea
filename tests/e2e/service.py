"""The real service as its users run it: `gaplab serve` as a process, asked over HTTP."""

import os
import signal
import socket
import subprocess
import sys
import time

import httpx2

from tests.processes import processes, processes_with


class Service:
    """`gaplab serve` on a free port of loopback, with its own database, workers and log.

    Attributes:
        url: where it answers.
        http: a client of it.
    """

    def __init__(self, folder, database_url=None, plugins=""):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        self.url = f"http://127.0.0.1:{port}"
        self.http = httpx2.Client(base_url=self.url, timeout=30)
        self._log = folder / "service.log"
        self._environment = os.environ | {
            "GAPLAB_DATABASE_URL": database_url or f"sqlite:///{folder / 'gaplab.db'}",
            "GAPLAB_PORT": str(port),
            "GAPLAB_WORKERS": "2",
            "GAPLAB_LEASE_S": "5",
            "GAPLAB_PLUGINS": str(plugins),
        }
        self._process = None

    def start(self):
        with self._log.open("ab") as log:
            command = [sys.executable, "-m", "gaplab", "serve"]
            self._process = subprocess.Popen(command, env=self._environment, stdout=log, stderr=log)
        wait_until(self._answers, 60, self.log)
        return self

    def stop(self, how=signal.SIGINT):
        """In order, as Ctrl-C does."""
        self._process.send_signal(how)
        assert self._process.wait(40) == 0, self.log()

    def kill(self):
        """Everything at once, with no time to say goodbye: the API, the supervisor, Ray and its workers."""
        for pid in [*self.processes(), self._process.pid]:
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
        self._process.wait()

    def kill_repetitions(self):
        """The processes of Ray that compute repetitions, and nothing else."""
        ours = set(self.processes())
        for pid, command in processes():
            if pid in ours and command.startswith(b"ray::run"):
                os.kill(pid, signal.SIGKILL)

    def processes(self):
        """Everything that runs with this service's port in its environment."""
        return processes_with(f"GAPLAB_PORT={self._environment['GAPLAB_PORT']}")

    def log(self):
        return self._log.read_text()

    def close(self):
        self.http.close()
        if self._process and self._process.poll() is None:
            self.stop()

    def get(self, path, **query):
        answer = self.http.get(path, params=query)
        assert answer.status_code == 200, answer.text
        return answer.json()

    def post(self, path, body):
        answer = self.http.post(path, json=body)
        assert answer.status_code == 202, answer.text
        assert self.get(answer.headers["location"])["id"] == answer.json()["id"]
        return answer.json()

    def finish(self, path, within_s):
        """The resource at the path, once it has ended."""
        wait_until(lambda: self.get(path)["state"] not in {"QUEUED", "RUNNING"}, within_s, lambda: self.get(path))
        return self.get(path)

    def _answers(self):
        try:
            return self.http.get("/readyz").status_code == 200
        except httpx2.TransportError:
            return False


def wait_until(condition, within_s, otherwise=lambda: "it took too long"):
    deadline = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < deadline, otherwise()
        time.sleep(0.1)
