"""Which tests a run has, on which databases, in which process, and how long they took.

`make test` is what every change must pass. `make test-all`, with the option `--all`, has the rest: tests marked
`release`, and Postgres for every test of a store. In `make test`, a test of a store runs on SQLite; one marked
`dialects`, because the databases may differ there, runs on both.

Tests that share what starts slowly run in one process, and come first: Ray, a browser, the law that MuJoCo compiles.
The others stay together by file.
"""

import gc
import os
import re
import resource
from collections import defaultdict
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from xdist.scheduler import LoadScopeScheduling

ROOT = Path(__file__).parents[1]

SHARED = {"ray": r"\bshared_ray\b|usefixtures\(\"ray\"\)", "browser": r"\bvisit\b"}
"""What the tests of a file share, and how its text says so. They come first, then the tests with MuJoCo."""

STORES = ("store_url", "database_url")
"""Fixtures that have a parameter for each database."""

SLOWEST = 10
"""Files that the closing table lists."""

_seconds: dict[str, float] = defaultdict(float)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option of `make test-all`."""
    parser.addoption("--all", action="store_true", help="also tests marked `release`, and every store on Postgres")


def pytest_configure(config: pytest.Config) -> None:
    """Describe the marks, and collect no garbage until all tests are collected: there is none."""
    if config.getoption("numprocesses", None) is None:  # with processes of its own, pytest collects nothing here
        gc.disable()
    os.environ["RAY_worker_niceness"] = "0"  # noqa: SIM112  # with Ray's 15, its workers wait for all others
    for mark in (
        "release: only in `make test-all`",
        "dialects: SQLite and Postgres may differ here, so `make test` has both",
    ):
        config.addinivalue_line("markers", mark)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what is for a release, and put first what shares a process."""
    if not config.getoption("all"):
        left = [item for item in items if _is_for_a_release(item)]
        if left:
            config.hook.pytest_deselected(items=left)
            items[:] = [item for item in items if not _is_for_a_release(item)]
    order = [*SHARED, "mujoco"]
    items.sort(key=lambda item: order.index(name) if (name := group(item.nodeid)) in order else len(order))


def pytest_collection_finish() -> None:
    """Spare the garbage collector what lives as long as the process: looking through it took a tenth of the time."""
    gc.freeze()
    gc.enable()


def _is_for_a_release(item: pytest.Item) -> bool:
    if item.get_closest_marker("release"):
        return True
    chosen = getattr(item, "callspec", None)
    on_postgres = chosen is not None and "postgres" in [chosen.params.get(name) for name in STORES]
    return on_postgres and not item.get_closest_marker("dialects")


@cache
def _shared(file: str) -> str | None:
    text = (ROOT / file).read_text()
    return next((name for name, said in SHARED.items() if re.search(said, text)), None)


def group(nodeid: str) -> str:
    """Return what the tests of one process have in common: something shared, or their file."""
    file = nodeid.partition("::")[0]
    return _shared(file) or ("mujoco" if "mujoco" in nodeid else file)


class _Together(LoadScopeScheduling):
    """Gives each group of tests to one process."""

    def _split_scope(self, nodeid: str) -> str:
        return group(nodeid)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling:
    """Distribute the tests by what they share."""
    return _Together(config, log)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up the time of each file."""
    _seconds[report.nodeid.partition("::")[0]] += report.duration


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Print the slowest files and the sums by folder."""
    if hasattr(config, "workerinput") or len(_seconds) == 1:
        return
    folders: dict[str, float] = defaultdict(float)
    for file, seconds in _seconds.items():
        folders["/".join(file.split("/")[:2])] += seconds
    terminalreporter.section("seconds of all processes together")
    for title, rows in (("by folder", folders), ("slowest files", _seconds)):
        terminalreporter.line(f"{title}:")
        for name, seconds in sorted(rows.items(), key=lambda row: -row[1])[:SLOWEST]:
            terminalreporter.line(f"{seconds:8.1f}  {name}")
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    minutes = sum(each.ru_utime + each.ru_stime for each in used) / 60
    terminalreporter.line(f"processor time: {minutes:.1f} minutes, of processes that have ended")
    if not config.getoption("all"):
        terminalreporter.line("`make test-all` has the rest: deselected above")
