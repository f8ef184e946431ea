"""`python -m benchmarks.load`: does a service with 400 000 samples answer as fast as an empty one?

Over HTTP, 50 clients read lists and curves, 20 submit and 10 follow events of a real service, all at once. This is
repeated on SQLite and Postgres: with a single study, with a full page of each list, and with 10 000 experiments.
Clients pause between requests like a person or a page, so the times are those of answering, not of queueing.
`--pause 0` removes the pauses.
"""

import argparse
import json
import os
import platform
import random
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from functools import partial
from http.client import HTTPConnection, HTTPException
from pathlib import Path
from statistics import median, quantiles
from tempfile import TemporaryDirectory
from urllib.parse import urlsplit

from rich.console import Console
from rich.table import Table

from gaplab import migrations
from gaplab.api.process.local_service import start_service
from gaplab.services.store.session import Store
from tests.filling import IN_A_STUDY, REPETITIONS, SAMPLES, experiment_id, fill, study_id
from tests.postgres import running

READERS, SUBMITTERS, STREAMS = 50, 20, 10
NEXT_TO_NOTHING, A_PAGE = IN_A_STUDY, 50 * IN_A_STUDY  # experiments of one study, and those that fill the longest list
UNLIMITED = {f"GAPLAB_MAX_{name}": str(10**6) for name in ("EXPERIMENTS", "EXPERIMENTS_PER_TOKEN")}
"""Limits for submissions, which are never computed here: the default of 1 000 would be reached soon."""
SPEC = json.dumps({"strategy": "simulated_fit", "robot": "toy_function", "budget": "smoke", "repetitions": 2})
PATIENCE_S = 60.0
KEPT_ALIVE_S = 2.0  # longest pause for which a connection is reused; the server closes it after five seconds

READS: dict[str, Callable[[int], str]] = {
    "studies, newest 50": lambda _: "/studies?limit=50",
    "studies that run": lambda _: "/studies?state=RUNNING",
    "studies of a strategy": lambda _: "/studies?strategy=informative",
    "a study": lambda n: f"/studies/{study_id(random.randrange(n // IN_A_STUDY))}",
    "an experiment": lambda n: f"/experiments/{experiment_id(random.randrange(n))}",
    "its samples": lambda n: f"/experiments/{experiment_id(random.randrange(n))}/samples",
    "its curve": lambda n: f"/experiments/{experiment_id(random.randrange(n))}/curve",
    "a study's curves": lambda n: f"/curves?study={study_id(random.randrange(n // IN_A_STUDY))}",
}
"""Paths of requests, from the number of stored experiments."""
SUBMIT, FOLLOW = "submit an experiment", "events on a stream"


class Clients:
    """Simultaneous clients of one service: seconds and errors by kind of request, and the events that they received."""

    def __init__(self, url: str, experiments: int, seconds: float, pause_s: float) -> None:
        self.seconds: dict[str, list[float]] = defaultdict(list)
        self.errors: Counter[str] = Counter()
        self.events = 0
        self._address, self._experiments, self._pause_s = urlsplit(url).netloc, experiments, pause_s
        self._end = time.monotonic() + seconds

    def run(self) -> "Clients":
        """Run all clients to their end."""
        work: list[Callable[[], None]] = [partial(self._read, number) for number in range(READERS)]
        work += [self._submit] * SUBMITTERS + [self._follow] * STREAMS
        with ThreadPoolExecutor(len(work)) as clients:
            list(clients.map(lambda client: client(), work))
        return self

    def told(self, kind: str) -> str:
        """Return median, 99th percentile and errors as text."""
        seconds = self.seconds[kind]
        if len(seconds) < 2:
            return f"- / - / {self.errors[kind]}"
        hundredths = quantiles(seconds, n=100, method="inclusive")
        return f"{hundredths[49] * 1e3:.0f} / {hundredths[98] * 1e3:.0f} / {self.errors[kind]}"

    def _read(self, turn: int) -> None:
        kinds = list(READS)
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
            self.errors[kind] += 1
            return
        self.seconds[kind].append(time.perf_counter() - begun)
        self.errors[kind] += answer.status >= 300

    def _follow(self) -> None:
        answer = None
        with self._connected() as connection:
            connection.timeout = 1.0
            try:
                connection.request("GET", "/events", headers={"Accept": "text/event-stream"})
                answer = connection.getresponse()
                self.errors[FOLLOW] += answer.status != 200
                while time.monotonic() < self._end:
                    if not (line := answer.readline()):
                        self.errors[FOLLOW] += 1
                        return
                    self.events += line.startswith(b"id:")
            except (OSError, HTTPException) as error:  # a stream that times out cannot be read again
                self.errors[FOLLOW] += answer is None or not isinstance(error, TimeoutError)

    @contextmanager
    def _connected(self) -> Iterator[HTTPConnection]:
        connection = HTTPConnection(self._address, timeout=PATIENCE_S)
        yield connection
        connection.close()


def measure(url: str, folder: Path, experiments: int, options: argparse.Namespace) -> Clients:
    """Measure the load on a new database with stored experiments."""
    migrations.upgrade(url)
    store = Store(url)
    begun = time.monotonic()
    fill(store, experiments)
    store.dispose()
    print(f"  {experiments:,} experiments stored in {time.monotonic() - begun:.0f} s", flush=True)
    with start_service(url, folder / "api.log", workers=False) as client:
        Clients(client.url, experiments, min(3.0, options.seconds), options.pause).run()  # warms up
        return Clients(client.url, experiments, options.seconds, options.pause).run()


def table(name: str, measured: dict[int, Clients]) -> Table:
    """Return the table of one kind of database, by number of stored experiments."""
    *_, page, full = measured.values()
    shown = Table("request", title=f"{name}: median / 99th percentile in ms / errors")
    stored = (f"{count:,} experiments, {count * REPETITIONS * SAMPLES:,} samples" for count in measured)
    for column in (*stored, "ratio of medians, last two columns"):
        shown.add_column(column, justify="right")
    for kind in (*READS, SUBMIT):
        both = [median(each.seconds[kind] or [float("nan")]) for each in (full, page)]
        shown.add_row(kind, *(each.told(kind) for each in measured.values()), f"{both[0] / both[1]:.2f}")
    shown.add_row(FOLLOW, *(f"{each.events:,} / {each.errors[FOLLOW]} errors" for each in measured.values()), "")
    shown.add_row("answers in all", *(f"{sum(map(len, each.seconds.values())):,}" for each in measured.values()), "")
    return shown


def main() -> None:
    """Measure, and print a table for each kind of database."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0, help="duration of each load")
    parser.add_argument("--experiments", type=int, default=10_000, help="number of stored experiments")
    parser.add_argument("--pause", type=float, default=1.0, help="seconds between the requests of a client")
    parser.add_argument("--databases", nargs="+", choices=("sqlite", "postgres"), default=["sqlite", "postgres"])
    options = parser.parse_args()
    os.environ.update(UNLIMITED)
    print(f"{READERS} readers, {SUBMITTERS} submitters on {os.cpu_count()} cores of {platform.machine()}", flush=True)
    for database in options.databases:
        with TemporaryDirectory() as folder:
            measured = {}
            for experiments in (NEXT_TO_NOTHING, A_PAGE, options.experiments):
                place = Path(folder) / str(experiments)
                place.mkdir()
                with running(place) if database == "postgres" else nullcontext(f"sqlite:///{place / 'load.db'}") as url:
                    measured[experiments] = measure(url, place, experiments, options)
            Console(width=120).print(table(database, measured))


if __name__ == "__main__":
    main()
