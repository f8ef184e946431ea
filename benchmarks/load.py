"""`python -m benchmarks.load`: does a service with 400 000 samples answer as fast as an empty one?

50 clients read lists and curves, 20 submit, and 10 follow the events, all at once, of a real service over HTTP; on
SQLite and on Postgres, with next to nothing stored, with a page of everything, and with 10 000 experiments. A client
pauses between its requests as a person or a page does, so that what is measured is answering and not queueing;
`--pause 0` asks as fast as it can.
"""

import argparse
import json
import os
import platform
import random
import socket
import subprocess
import sys
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.client import HTTPConnection, HTTPException
from pathlib import Path
from statistics import quantiles
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.table import Table

import migrations
from benchmarks.filling import IN_A_STUDY, REPETITIONS, SAMPLES, experiment_id, fill, study_id
from benchmarks.supervisor import postgres
from services.store.session import Store

READERS, SUBMITTERS, STREAMS = 50, 20, 10
NEXT_TO_NOTHING, A_PAGE = IN_A_STUDY, 50 * IN_A_STUDY
"""Experiments: one study's, and as many as the longest list shows. What comes after these is what storing costs."""

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
        port: of the service on loopback.
        experiments: that are stored.
        seconds: that it lasts.
        pause_s: of a client between an answer and its next request.
    """

    def __init__(self, port: int, experiments: int, seconds: float, pause_s: float) -> None:
        self._port, self._experiments, self._pause_s = port, experiments, pause_s
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
        connection = HTTPConnection("127.0.0.1", self._port, timeout=PATIENCE_S)
        yield connection
        connection.close()


@contextmanager
def served(url: str, folder: Path) -> Iterator[int]:
    """The API as a process of its own, on a free port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    environment = os.environ | {"GAPLAB_DATABASE_URL": url, "GAPLAB_PORT": str(port), "GAPLAB_HOST": "127.0.0.1"}
    with (folder / "api.log").open("ab") as log:
        process = subprocess.Popen([sys.executable, "-m", "api"], env=environment, stdout=log, stderr=log)
    try:
        _wait_for(port, process)
        yield port
    finally:
        process.terminate()
        process.wait(60)


def _wait_for(port: int, process: "subprocess.Popen[bytes]") -> None:
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and process.poll() is None:
        with suppress(OSError, HTTPException):
            connection = HTTPConnection("127.0.0.1", port, timeout=5)
            connection.request("GET", "/readyz")
            if connection.getresponse().status == 200:
                return
        time.sleep(0.1)
    message = f"the service does not answer; it ended with {process.poll()}"
    raise RuntimeError(message)


def measure(url: str, folder: Path, experiments: int, options: argparse.Namespace) -> Measured:
    """The load on a new database with so many experiments."""
    migrations.upgrade(url)
    store = Store(url)
    begun = time.monotonic()
    fill(store, experiments)
    store.dispose()
    print(f"  {experiments:,} experiments stored in {time.monotonic() - begun:.0f} s", flush=True)
    with served(url, folder) as port:
        Load(port, experiments, min(3.0, options.seconds), options.pause).run()  # warms up
        return Load(port, experiments, options.seconds, options.pause).run()


def table(name: str, found: dict[int, Measured]) -> Table:
    """The figures of one kind of database, by the number of experiments stored."""
    *_, page, full = found.values()
    shown = Table(title=f"{name}: median / 99th percentile in ms / errors")
    shown.add_column("request")
    for experiments in found:
        shown.add_column(
            f"{experiments:,} experiments, {experiments * REPETITIONS * SAMPLES:,} samples", justify="right"
        )
    shown.add_column("medians, last to a page", justify="right")
    for kind in (*READS, SUBMIT):
        times = f"{full.median(kind) / page.median(kind):.2f}"
        shown.add_row(kind, *(each.of(kind) for each in found.values()), times)
    if any(each.events for each in found.values()):
        shown.add_row(FOLLOW, *(f"{each.events:,} / {each.errors[FOLLOW]} errors" for each in found.values()), "")
    shown.add_row("answers in all", *(f"{sum(map(len, each.seconds.values())):,}" for each in found.values()), "")
    return shown


def main() -> None:
    """Measure, and print a table for each kind of database."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0, help="that each load lasts")
    parser.add_argument("--experiments", type=int, default=10_000, help="that are stored")
    parser.add_argument("--pause", type=float, default=1.0, help="seconds between the requests of a client")
    parser.add_argument("--databases", nargs="+", choices=("sqlite", "postgres"), default=["sqlite", "postgres"])
    options = parser.parse_args()
    print(f"{READERS} readers, {SUBMITTERS} submitters on {os.cpu_count()} cores of {platform.machine()}", flush=True)
    for database in options.databases:
        with TemporaryDirectory() as folder:
            found = {}
            for experiments in (NEXT_TO_NOTHING, A_PAGE, options.experiments):
                place = Path(folder) / str(experiments)
                place.mkdir()
                with postgres(place) if database == "postgres" else _sqlite(place) as url:
                    found[experiments] = measure(url, place, experiments, options)
            Console(width=120).print(table(database, found))
            if not any(each.events for each in found.values()):
                print("Events were left out: the service serves none at /events.", flush=True)


@contextmanager
def _sqlite(folder: Path) -> Iterator[str]:
    yield f"sqlite:///{folder / 'load.db'}"


if __name__ == "__main__":
    main()
