"""Many simultaneous clients of one service, and the durations of their requests."""

import json
import random
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.client import HTTPConnection, HTTPException
from statistics import quantiles
from urllib.parse import urlsplit

from tests.filling import IN_A_STUDY, experiment_id, study_id

READERS, SUBMITTERS, STREAMS = 50, 20, 10
SPEC = json.dumps({"strategy": "simulated_fit", "robot": "toy_function", "budget": "smoke", "repetitions": 2})
PATIENCE_S = 60.0
KEPT_ALIVE_S = 2.0
"""Longest pause for which a connection is reused: the server closes it after two and a half times that."""

Path_ = Callable[[int], str]
"""A function from the number of stored experiments to the path of a request."""

READS: dict[str, Path_] = {
    "experiments, newest 50": lambda _: "/experiments?limit=50",
    "experiments of a study": lambda n: f"/experiments?study={study_id(random.randrange(n // IN_A_STUDY))}",
    "experiments that run": lambda _: "/experiments?state=RUNNING",
    "experiments of a strategy": lambda _: "/experiments?strategy=informative",
    "studies, newest 50": lambda _: "/studies?limit=50",
    "an experiment": lambda n: f"/experiments/{experiment_id(random.randrange(n))}",
    "its samples": lambda n: f"/experiments/{experiment_id(random.randrange(n))}/samples",
    "its curve": lambda n: f"/experiments/{experiment_id(random.randrange(n))}/curve",
    "a study's curves": lambda n: f"/studies/{study_id(random.randrange(n // IN_A_STUDY))}/curves",
}
SUBMIT, FOLLOW = "submit an experiment", "events on a stream"


@dataclass
class RequestTimes:
    """Durations and errors of the clients' requests.

    Attributes:
        seconds: duration of each answer, by kind of request.
        errors: number of unsuccessful answers and broken connections, by kind of request.
        events: number of events received on streams.
    """

    seconds: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    errors: Counter[str] = field(default_factory=Counter)
    events: int = 0

    def of(self, kind: str) -> str:
        """Return median, 99th percentile and errors as text."""
        seconds = self.seconds[kind]
        if len(seconds) < 2:
            return f"- / - / {self.errors[kind]}"
        hundredths = quantiles(seconds, n=100, method="inclusive")
        return f"{hundredths[49] * 1e3:.0f} / {hundredths[98] * 1e3:.0f} / {self.errors[kind]}"

    def median(self, kind: str) -> float:
        """Return the median in seconds; nan without answers."""
        seconds = sorted(self.seconds[kind])
        return seconds[len(seconds) // 2] if seconds else float("nan")


class Clients:
    """Simultaneous clients of one service.

    Args:
        url: address of the service.
        experiments: number of stored experiments.
        seconds: duration of the load.
        pause_s: pause of a client between an answer and its next request.
    """

    def __init__(self, url: str, experiments: int, seconds: float, pause_s: float) -> None:
        self._address, self._experiments, self._pause_s = urlsplit(url).netloc, experiments, pause_s
        self._end = time.monotonic() + seconds
        self._measured = RequestTimes()

    def run(self) -> RequestTimes:
        """Run all clients, and return their measurements."""
        clients = [threading.Thread(target=self._read, args=(number,)) for number in range(READERS)]
        clients += [threading.Thread(target=self._submit) for _ in range(SUBMITTERS)]
        if self._streams():
            clients += [threading.Thread(target=self._follow) for _ in range(STREAMS)]
        for client in clients:
            client.start()
        for client in clients:
            client.join()
        return self._measured

    def _read(self, number: int) -> None:
        kinds = list(READS)
        turn = number
        with self._connected() as connection:
            while self._going_on():
                kind = kinds[turn % len(kinds)]
                turn += 1
                self._ask(connection, kind, "GET", READS[kind](self._experiments))

    def _submit(self) -> None:
        with self._connected() as connection:
            while self._going_on():
                self._ask(connection, SUBMIT, "POST", "/experiments", SPEC)

    def _going_on(self) -> bool:
        """Pause for a random time, so that clients do not synchronise; return whether the load continues."""
        time.sleep(self._pause_s * random.uniform(0.5, 1.5))
        return time.monotonic() < self._end

    def _ask(self, connection: HTTPConnection, kind: str, method: str, path: str, body: str | None = None) -> None:
        if self._pause_s > KEPT_ALIVE_S:
            connection.close()  # the service has closed it; the next request opens it again
        begun = time.perf_counter()
        try:
            connection.request(method, path, body, {"Content-Type": "application/json"} if body else {})
            answer = connection.getresponse()
            answer.read()
        except (OSError, HTTPException):
            connection.close()
            self._measured.errors[kind] += 1
            return
        self._measured.seconds[kind].append(time.perf_counter() - begun)
        if answer.status >= 300:
            self._measured.errors[kind] += 1

    def _streams(self) -> bool:
        """Return whether the service streams events."""
        with self._connected() as connection:
            connection.request("GET", "/events", headers={"Accept": "text/event-stream"})
            return connection.getresponse().status == 200

    def _follow(self) -> None:
        with self._connected() as connection:
            connection.timeout = 1.0
            try:
                connection.request("GET", "/events", headers={"Accept": "text/event-stream"})
                answer = connection.getresponse()
            except (OSError, HTTPException):
                self._measured.errors[FOLLOW] += 1
                return
            if answer.status != 200:
                self._measured.errors[FOLLOW] += 1
            while time.monotonic() < self._end:
                try:
                    if not (line := answer.readline()):
                        self._measured.errors[FOLLOW] += 1
                        return
                except TimeoutError:
                    return  # a socket that timed out cannot be read again
                except (OSError, HTTPException):
                    self._measured.errors[FOLLOW] += 1
                    return
                self._measured.events += line.startswith(b"id:")

    @contextmanager
    def _connected(self) -> Iterator[HTTPConnection]:
        connection = HTTPConnection(self._address, timeout=PATIENCE_S)
        yield connection
        connection.close()
