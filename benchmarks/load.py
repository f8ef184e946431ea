"""`python -m benchmarks.load`: does a service with 400 000 samples answer as fast as an empty one?

Over HTTP, 50 clients read lists and curves, 20 submit and 10 follow events of a real service, all at once. This is
repeated on SQLite and Postgres: with a single study, with a full page of each list, and with 10 000 experiments.
Clients pause between requests like a person or a page, so the times are those of answering, not of queueing.
`--pause 0` removes the pauses.
"""

import argparse
import os
import platform
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.table import Table

from benchmarks.clients import FOLLOW, READERS, READS, SUBMIT, SUBMITTERS, Clients, RequestTimes
from gaplab import migrations
from gaplab.api.process.local_service import start_service
from gaplab.services.store.session import Store
from tests.filling import IN_A_STUDY, REPETITIONS, SAMPLES, fill
from tests.postgres import running

UNLIMITED = {f"GAPLAB_MAX_{name}": str(10**6) for name in ("EXPERIMENTS", "EXPERIMENTS_PER_TOKEN")}
"""Limits for submissions, which are never computed here: the default of 1 000 would be reached soon."""

NEXT_TO_NOTHING, A_PAGE = IN_A_STUDY, 50 * IN_A_STUDY
"""Numbers of experiments: those of one study, and those that fill the longest list."""


def measure(url: str, folder: Path, experiments: int, options: argparse.Namespace) -> RequestTimes:
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


def table(name: str, measured: dict[int, RequestTimes]) -> Table:
    """Return the table of one kind of database, by number of stored experiments."""
    *_, page, full = measured.values()
    shown = Table(title=f"{name}: median / 99th percentile in ms / errors")
    shown.add_column("request")
    for experiments in measured:
        shown.add_column(
            f"{experiments:,} experiments, {experiments * REPETITIONS * SAMPLES:,} samples", justify="right"
        )
    shown.add_column("ratio of medians, last two columns", justify="right")
    for kind in (*READS, SUBMIT):
        times = f"{full.median(kind) / page.median(kind):.2f}"
        shown.add_row(kind, *(each.of(kind) for each in measured.values()), times)
    if any(each.events for each in measured.values()):
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
                with running(place) if database == "postgres" else _sqlite(place) as url:
                    measured[experiments] = measure(url, place, experiments, options)
            Console(width=120).print(table(database, measured))
            if not any(each.events for each in measured.values()):
                print("Events were not measured: the service has no /events.", flush=True)


@contextmanager
def _sqlite(folder: Path) -> Iterator[str]:
    yield f"sqlite:///{folder / 'load.db'}"


if __name__ == "__main__":
    main()
