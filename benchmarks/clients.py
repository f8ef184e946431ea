"""Many clients of one service at once, and how long each of their requests took."""

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
"""Longer than two and a half times that, and the server closes a connection on which nothing happens."""

Path_ = Callable[[int], str]
"""The address of a request, in a database with so many experiments."""

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
class Measured:
    """What the clients saw; of a stream, how long after the one before an event came is not counted, only that it did.

    Attributes:
        seconds: of each answer, by kind of request.
        errors: by kind of request: answers that are no success, and broken connections.
    """

    seconds: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    errors: Counter[str] = field(default_factory=Counter)
    events: int = 0

    def of(self, kind: str) -> str:
        """Median, 99th percentile and errors."""
        found = self.seconds[kind]
        if len(found) < 2:
            return f"- / - / {self.errors[kind]}"
        hundredths = quantiles(found, n=100, method="inclusive")
        return f"{hundredths[49] * 1e3:.0f} / {hundredths[98] * 1e3:.0f} / {self.errors[kind]}"

    def median(self, kind: str) -> float:
        """In seconds; nan if there is none."""
        found = sorted(self.seconds[kind])
        return found[len(found) // 2] if found else float("nan")


class Load:
    """All clients of one service at once.

    Args:
        url: of the service.
        experiments: that are stored.
        seconds: that it lasts.
        pause_s: of a client between an answer and its next request.
    """

    def __init__(self, url: str, experiments: int, seconds: float, pause_s: float) -> None:
        self._address, self._experiments, self._pause_s = urlsplit(url).netloc, experiments, pause_s
        self._end = time.monotonic() + seconds
        self._measured = Measured()

    def run(self) -> Measured:
        """What the clients measured."""
        clients = [threading.Thread(target=self._read, args=(each,)) for each in range(READERS)]
        clients += [threading.Thread(target=self._submit) for _ in range(SUBMITTERS)]
        if self._streams():
            clients += [threading.Thread(target=self._follow) for _ in range(STREAMS)]
        for each in clients:
            each.start()
        for each in clients:
            each.join()
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
        """After a pause, of which the length differs, so that clients do not march in step."""
        time.sleep(self._pause_s * random.uniform(0.5, 1.5))
        return time.monotonic() < self._end

    def _ask(self, connection: HTTPConnection, kind: str, method: str, path: str, body: str | None = None) -> None:
        if self._pause_s > KEPT_ALIVE_S:
            connection.close()  # the service did so already; the next request opens it again
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
        """Whether the service has events to follow."""
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
                    return  # a socket that timed out once cannot be read any more
                except (OSError, HTTPException):
                    self._measured.errors[FOLLOW] += 1
                    return
                self._measured.events += line.startswith(b"id:")

    @contextmanager
    def _connected(self) -> Iterator[HTTPConnection]:
        connection = HTTPConnection(self._address, timeout=PATIENCE_S)
        yield connection
        connection.close()
