"""`python -m benchmarks.page`: size of the page, time until it shows a list and a curve, and latencies of the API.

A real Chromium loads it from a real API on SQLite, first with an empty cache and then with a full one. The database has
a published study of this repository, alone and beside 10 000 experiments. Times are also ratios to `/livez`, the
quickest answer of the same process in the same minute: these compare between machines and versions.
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

import httpx2
from playwright.sync_api import Browser, sync_playwright
from rich.console import Console
from rich.table import Table

from gaplab import migrations
from gaplab.api.process.local_service import start_service
from gaplab.services.archives import import_archive
from gaplab.services.store.session import Store
from tests.filling import fill

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = ("--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""Flags for WebGL without a graphics card."""

PUBLISHED = Path(__file__).parents[1] / "docs" / "studies" / "figure-4-mujoco.zip"

VIEWS = {
    "list": ("", ".list tbody tr"),
    "study, until its curves show": ("#/studies/{}", ".plot .scatterlayer .trace"),
    "experiment, until its curve shows": ("#/experiments/{}", ".plot .scatterlayer .trace"),
    "new study, until its cost shows": ("#/new", ".panel .big"),
}


ANSWERS = ("/experiments", "/studies/{study}", "/studies/{study}/curves", "/experiments/{experiment}/samples")
"""Paths of the API whose latencies are measured."""

WARMING, ASKED = 10, 30
"""Requests before a latency is measured, and for it."""


@dataclass(frozen=True)
class Visit:
    """One visit: seconds until the view showed, kilobytes and number of requests."""

    seconds: float
    kilobytes: float
    requests: int


def main() -> None:
    """Measure every view, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--experiments", type=int, default=10_000, help="experiments in the full database")
    parser.add_argument("--rounds", type=int, default=5, help="number of visits; the table has medians")
    arguments = parser.parse_args()
    table = Table(title=f"The page on {os.cpu_count()} cores of {platform.machine()}")
    columns = ("view", "experiments", "cold", "warm", "cold / livez", "warm / livez", "cold kB", "warm kB", "requests")
    for column in columns:
        table.add_column(column, justify="left" if column == "view" else "right")
    for experiments in (0, arguments.experiments):
        with _served(experiments) as (url, ids), _chromium() as browser:
            livez = _latency(f"{url}/livez")
            for name, (address, ready) in VIEWS.items():
                id_ = ids["study" if "studies" in address else "experiment"]
                visits = [_visits(browser, f"{url}/{address.format(id_)}", ready) for _ in range(arguments.rounds)]
                table.add_row(name, f"{experiments + 7:,}", *_cells(visits, livez))
            for path in ("/livez", *ANSWERS):
                seconds = _latency(url + path.format(**ids))
                cells = f"{1000 * seconds:.1f} ms", "", f"{seconds / livez:.1f}"
                table.add_row(f"GET {path}", f"{experiments + 7:,}", *cells)
    Console(width=140).print(table)


@contextmanager
def _served(experiments: int) -> Iterator[tuple[str, dict[str, str]]]:
    """Serve the API on a database with experiments beside the published study; yield its URL and that study's ids."""
    with TemporaryDirectory(prefix="gaplab-page-") as folder:
        database_url = f"sqlite:///{Path(folder) / 'gaplab.db'}"
        migrations.upgrade(database_url)
        store = Store(database_url)
        fill(store, experiments)
        with PUBLISHED.open("rb") as archive:
            stored = import_archive(store, archive)
        store.dispose()
        with start_service(database_url, Path(folder) / "api.log", workers=False) as client:
            yield client.url, {"study": stored.study or "", "experiment": stored.experiments[0]}


@contextmanager
def _chromium() -> Iterator[Browser]:
    """Start the machine's Chromium, or else Playwright's own."""
    path = os.environ.get("GAPLAB_CHROMIUM") or next(filter(None, map(shutil.which, BROWSERS)), None)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()


def _visits(browser: Browser, address: str, ready: str) -> tuple[Visit, Visit]:
    """Visit an address with an empty cache, and again with a full one."""
    page = browser.new_page(viewport={"width": 1280, "height": 900}, reduced_motion="reduce")
    page.set_default_timeout(60_000)
    devtools = page.context.new_cdp_session(page)
    devtools.send("Network.enable")
    sizes: list[float] = []
    devtools.on("Network.loadingFinished", lambda event: sizes.append(event["encodedDataLength"]))
    visits = []
    for _ in range(2):
        sizes.clear()
        page.goto("about:blank")
        start = time.perf_counter()
        page.goto(address, wait_until="commit")
        page.locator(ready).first.wait_for()
        visits.append(Visit(time.perf_counter() - start, sum(sizes) / 1000, len(sizes)))
    page.context.close()
    return visits[0], visits[1]


def _latency(address: str) -> float:
    """Return the median of the seconds that an answer takes on a kept connection, once the service is warm."""
    times = []
    with httpx2.Client(trust_env=False) as client:
        for _ in range(WARMING):
            client.get(address).raise_for_status()
        for _ in range(ASKED):
            start = time.perf_counter()
            client.get(address).raise_for_status()
            times.append(time.perf_counter() - start)
    return median(times)


def _cells(pairs: list[tuple[Visit, Visit]], livez_s: float) -> tuple[str, ...]:
    cold, warm = zip(*pairs, strict=True)
    seconds = [median(each.seconds for each in visits) for visits in (cold, warm)]
    return (
        *(f"{1000 * each:.0f} ms" for each in seconds),
        *(f"{each / livez_s:.0f}" for each in seconds),
        *(f"{median(each.kilobytes for each in visits):,.0f}" for visits in (cold, warm)),
        ", ".join(f"{median(each.requests for each in visits):.0f}" for visits in (cold, warm)),
    )


if __name__ == "__main__":
    main()
