"""Which tests a run has, on which databases, in which process, and how long they took.

`make test` is what every change must pass. `make test-all`, with the option `--all`, has the rest: tests marked
`release`, and Postgres for every test of a store. In `make test`, a test of a store runs on SQLite; one marked
`dialects`, because the databases may differ there, runs on both.

Tests that share something that is slow to start run in one process. Other tests stay together by file, except those of
a file marked `apart`.
"""

import resource
from collections import defaultdict
from typing import Any

import pytest

SHARED = ("shared_ray", "browser", "mujoco")
"""What starts slowly: two fixtures, and an engine that compiles its law. Their groups come first."""

STORES = ("store_url", "database_url")
"""Fixtures that have a parameter for each database."""

SLOWEST = 10
"""Files that the closing table lists."""

_seconds: dict[str, float] = defaultdict(float)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option of `make test-all`."""
    parser.addoption("--all", action="store_true", help="also tests marked `release`, and every store on Postgres")


def pytest_configure(config: pytest.Config) -> None:
    """Describe the marks."""
    for mark in (
        "release: only in `make test-all`",
        "dialects: SQLite and Postgres may differ here, so `make test` has both",
        "apart: the tests of this file may run in several processes",
        "xdist_group: tests of one process",  # of xdist, which may be off
    ):
        config.addinivalue_line("markers", mark)


@pytest.hookimpl(tryfirst=True)  # before xdist reads the groups
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out what is for a release, and group the rest by what it shares; shared groups come first."""
    if not config.getoption("all"):
        left = [item for item in items if _is_for_a_release(item)]
        if left:
            config.hook.pytest_deselected(items=left)
            items[:] = [item for item in items if not _is_for_a_release(item)]
    for item in items:
        if name := _group(item):
            item.add_marker(pytest.mark.xdist_group(name))
    items.sort(key=lambda item: SHARED.index(name) if (name := _shared(item)) else len(SHARED))


def _is_for_a_release(item: pytest.Item) -> bool:
    if item.get_closest_marker("release"):
        return True
    chosen = getattr(item, "callspec", None)
    on_postgres = chosen is not None and "postgres" in [chosen.params.get(name) for name in STORES]
    return on_postgres and not item.get_closest_marker("dialects")


def _shared(item: pytest.Item) -> str | None:
    used = getattr(item, "fixturenames", ())
    return next((name for name in SHARED if name in used or name in item.nodeid), None)


def _group(item: pytest.Item) -> str | None:
    if name := _shared(item):
        return name
    return None if item.get_closest_marker("apart") else item.nodeid.partition("::")[0]


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
