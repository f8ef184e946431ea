"""`python -m benchmarks.page`: what the page weighs, and how soon it shows a list and a curve.

In a real Chromium, from a real API on SQLite, with next to nothing stored and with 10 000 experiments, each with the
study that is published with this repository; first with an empty cache, then again with a full one.
"""

import argparse
import os
import platform
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.table import Table

from gaplab import migrations
from gaplab.services.archives import import_archive
from gaplab.services.store.session import Store
from tests.e2e.api_alone import Api
from tests.e2e.browser import Chromium
from tests.filling import fill

PUBLISHED = Path(__file__).parents[1] / "docs" / "studies" / "mujoco-in-mujoco.zip"

VIEWS = {
    "list": ("", ".list tbody tr"),
    "study, to its curves": ("#/studies/{}", ".plot .scatterlayer .trace"),
    "experiment, to its curve": ("#/experiments/{}", ".plot .scatterlayer .trace"),
    "new study, to its cost": ("#/new", ".panel .big"),
}


@dataclass(frozen=True)
class Seen:
    """One visit: seconds until it was there, kilobytes and requests that it took."""

    seconds: float
    kilobytes: float
    requests: int


def main() -> None:
    """Measure every view, and print one table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--experiments", type=int, default=10_000, help="in the full database")
    parser.add_argument("--rounds", type=int, default=5, help="visits, of which the median counts")
    asked = parser.parse_args()
    table = Table(title=f"The page on {os.cpu_count()} cores of {platform.machine()}")
    for column in ("view", "experiments", "cold", "warm", "cold kB", "warm kB", "requests"):
        table.add_column(column, justify="left" if column == "view" else "right")
    for experiments in (0, asked.experiments):
        with _served(experiments) as (api, ids):
            browser = Chromium()
            try:
                for name, (address, ready) in VIEWS.items():
                    id_ = ids["study" if "study" in address or "studies" in address else "experiment"]
                    found = [_visits(browser, f"{api.url}/{address.format(id_)}", ready) for _ in range(asked.rounds)]
                    table.add_row(name, f"{experiments + 7:,}", *_cells(found))
            finally:
                browser.close()
    Console().print(table)


@contextmanager
def _served(experiments: int) -> Iterator[tuple[Api, dict[str, str]]]:
    """An API on a database with so many experiments beside the published study, and the ids of that."""
    folder = TemporaryDirectory(prefix="gaplab-page-")
    file = Path(folder.name) / "gaplab.db"
    migrations.upgrade(f"sqlite:///{file}")
    store = Store(f"sqlite:///{file}")
    fill(store, experiments)
    with PUBLISHED.open("rb") as archive:
        stored = import_archive(store, archive)
    store.dispose()
    api = Api(f"sqlite:///{file}", Path(folder.name) / "api.log").start()
    try:
        yield api, {"study": stored.study or "", "experiment": stored.experiments[0]}
    finally:
        api.close()
        shutil.rmtree(folder.name, ignore_errors=True)


def _visits(browser: Chromium, address: str, ready: str) -> tuple[Seen, Seen]:
    """One visit with nothing in the cache, and one with all that the first left there."""
    page = browser.visit("about:blank")
    wire = page.context.new_cdp_session(page)
    wire.send("Network.enable")
    sizes: list[float] = []
    wire.on("Network.loadingFinished", lambda told: sizes.append(told["encodedDataLength"]))
    seen = []
    for _ in range(2):
        sizes.clear()
        page.goto("about:blank")
        start = time.perf_counter()
        page.goto(address, wait_until="commit")
        page.locator(ready).first.wait_for()
        seen.append(Seen(time.perf_counter() - start, sum(sizes) / 1000, len(sizes)))
    page.context.close()
    return seen[0], seen[1]


def _cells(found: list[tuple[Seen, Seen]]) -> tuple[str, ...]:
    cold, warm = zip(*found, strict=True)
    return (
        *(f"{1000 * median(each.seconds for each in some):.0f} ms" for some in (cold, warm)),
        *(f"{median(each.kilobytes for each in some):,.0f}" for some in (cold, warm)),
        f"{median(each.requests for each in cold):.0f}",
    )


if __name__ == "__main__":
    main()
