"""The API alone, without Ray: `python -m api` on a database that is there already."""

import os
import signal
import subprocess
import sys
from typing import Any

import httpx2

from tests.ports import free_port
from tests.waiting import LONGEST_S, wait_until


class Api:
    """`python -m api` on a free port of loopback.

    Attributes:
        url: where it answers.
        http: a client of it.
    """

    def __init__(self, database_url: str, log: Any, plugins: Any = "") -> None:
        self._port = free_port()
        self.url = f"http://127.0.0.1:{self._port}"
        self.http = httpx2.Client(base_url=self.url, timeout=LONGEST_S)
        self._log = log
        self._environment = os.environ | {"GAPLAB_DATABASE_URL": database_url, "GAPLAB_PORT": str(self._port)}
        self._environment |= {"GAPLAB_PLUGINS": str(plugins)}
        self._process: Any = None

    def start(self) -> Any:
        with self._log.open("ab") as log:
            command = [sys.executable, "-m", "gaplab.api"]
            self._process = subprocess.Popen(command, env=self._environment, stdout=log, stderr=log)
        wait_until(self._answers, otherwise=self._log.read_text)
        return self

    def kill(self) -> None:
        self._process.send_signal(signal.SIGKILL)
        self._process.wait()

    def close(self) -> None:
        self.http.close()
        if self._process and self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
            self._process.wait(40)

    def get(self, path: Any, **query: Any) -> Any:
        answer = self.http.get(path, params=query)
        assert answer.status_code == 200, answer.text
        return answer.json()

    def _answers(self) -> bool:
        try:
            return self.http.get("/livez").status_code == 200
        except httpx2.TransportError:
            return False
