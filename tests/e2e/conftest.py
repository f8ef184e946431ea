"""Fixtures of the tests in a browser.

`visit(address, dark=…, width=…)` opens the page in Chromium, and fails the test if the console, a script or a request
reports an error; `visit(address, beside=page)` does so in another tab of that page's window, which shares its
connections; `visit.forgive(pattern, …)` names those that a test causes. `archive` is the API alone on a database
with ended experiments, `api` the same on the one of `written`, which tests fill as workers would, `shared_service` the
real service with workers.
"""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gaplab.schemas.lifecycle import OPEN
from gaplab.services.archives import import_archive
from gaplab.services.experiments.listing import ListFilter, list_experiments
from gaplab.services.experiments.submission import submit_experiment
from gaplab.services.store.session import Store
from tests.e2e.api_alone import Api
from tests.e2e.browser import Chromium
from tests.e2e.service import Service
from tests.experiments import cancel, toy
from tests.filling import fill

STUDY = Path(__file__).parents[2] / "docs" / "studies" / "figure-4-mujoco.zip"


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Of a module, not of all tests: Playwright keeps an event loop running, which others could not run beside."""
    browser = Chromium()
    yield browser
    browser.close()


@pytest.fixture
def visit(browser: Any) -> Iterator[Any]:
    """Opens the page at an address."""

    def open_page(address: Any, **how: Any) -> Any:
        return browser.visit(address, **how)

    open_page.forgive = browser.forgive  # type: ignore[attr-defined]
    yield open_page
    browser.end()


@pytest.fixture(scope="session")
def written_file(folder: Path, sqlite_template: Path) -> Any:
    """The database of `api`."""
    return Path(shutil.copy(sqlite_template, folder / "written.db"))


@pytest.fixture(scope="session")
def api(written_file: Any, folder: Path) -> Iterator[Any]:
    """The API alone, on a database that tests fill as workers would."""
    api = Api(f"sqlite:///{written_file}", folder / "written.log").start()
    yield api
    api.close()


@pytest.fixture
def written(written_file: Any) -> Iterator[Any]:
    """The database of `api`, in which nothing is queued when a test begins."""
    store = Store(f"sqlite:///{written_file}")
    yield store
    for state in OPEN:
        for each in list_experiments(store, ListFilter(state=state), limit=500, cursor=None).items:
            cancel(store, each.id)
    store.dispose()


@pytest.fixture(scope="session")
def archive(folder: Path, sqlite_template: Path) -> Iterator[Any]:
    """The API on a database with seventy made-up experiments, a published study and a cancelled experiment."""
    file = folder / "archive.db"
    shutil.copy(sqlite_template, file)
    store = Store(f"sqlite:///{file}")
    fill(store, 70)
    with STUDY.open("rb") as archived:
        import_archive(store, archived)
    cancel(store, submit_experiment(store, toy(name="given up")).id)
    store.dispose()
    api = Api(f"sqlite:///{file}", folder / "archive.log").start()
    yield api
    api.close()


@pytest.fixture(scope="session")
def shared_service(folder: Path) -> Iterator[Any]:
    """The real service, with workers, for all tests of the page."""
    place = folder / "service"
    place.mkdir()
    service = Service(place).start()
    yield service
    service.close()
