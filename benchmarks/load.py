"""`python -m benchmarks.load`: does a service with 400 000 samples answer as fast as an empty one?

50 clients read lists and curves, 20 submit, and 10 follow the events, all at once, of a real service over HTTP; on
SQLite and on Postgres, with next to nothing stored, with a page of everything, and with 10 000 experiments. A client
pauses between its requests as a person or a page does, so that what is measured is answering and not queueing;
`--pause 0` asks as fast as it can.
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

from benchmarks.clients import FOLLOW, READERS, READS, SUBMIT, SUBMITTERS, Load, Measured
from gaplab import migrations
from gaplab.api.process.local_service import start_service
from gaplab.services.store.session import Store
from tests.filling import IN_A_STUDY, REPETITIONS, SAMPLES, fill
from tests.postgres import running

UNLIMITED = {f"GAPLAB_MAX_{name}": str(10**6) for name in ("EXPERIMENTS", "EXPERIMENTS_PER_TOKEN")}
"""What is submitted is never computed here, so that a thousand would soon wait."""

NEXT_TO_NOTHING, A_PAGE = IN_A_STUDY, 50 * IN_A_STUDY
"""Experiments: one study's, and as many as the longest list shows. What comes after these is what storing costs."""


def measure(url: str, folder: Path, experiments: int, options: argparse.Namespace) -> Measured:
    """The load on a new database with so many experiments."""
    migrations.upgrade(url)
    store = Store(url)
    begun = time.monotonic()
    fill(store, experiments)
    store.dispose()
    print(f"  {experiments:,} experiments stored in {time.monotonic() - begun:.0f} s", flush=True)
    with start_service(url, folder / "api.log", workers=False) as client:
        Load(client.url, experiments, min(3.0, options.seconds), options.pause).run()  # warms up
        return Load(client.url, experiments, options.seconds, options.pause).run()


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
    os.environ.update(UNLIMITED)
    print(f"{READERS} readers, {SUBMITTERS} submitters on {os.cpu_count()} cores of {platform.machine()}", flush=True)
    for database in options.databases:
        with TemporaryDirectory() as folder:
            found = {}
            for experiments in (NEXT_TO_NOTHING, A_PAGE, options.experiments):
                place = Path(folder) / str(experiments)
                place.mkdir()
                with running(place) if database == "postgres" else _sqlite(place) as url:
                    found[experiments] = measure(url, place, experiments, options)
            Console(width=120).print(table(database, found))
            if not any(each.events for each in found.values()):
                print("Events were left out: the service serves none at /events.", flush=True)


@contextmanager
def _sqlite(folder: Path) -> Iterator[str]:
    yield f"sqlite:///{folder / 'load.db'}"


if __name__ == "__main__":
    main()
