"""Fixtures of the tests in a browser.

`visit(address, dark=…, width=…)` opens the page in a tab of Chromium, and fails the test if the console, a script or a
request reports an error; `visit.forgive(pattern, …)` names those that a test causes. `api` is the API alone on the
database of `written`, which tests fill as workers would, beside what `Known` names. For releases there are `archive`,
with a published study, and `shared_service`, the real service with workers.
"""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from gaplab.services.archives import import_archive
from gaplab.services.plugins import loading
from gaplab.services.store.session import Store
from tests.drawn_robot import FILES, strode
from tests.e2e.api_alone import Api
from tests.e2e.browser import Chromium
from tests.e2e.service import Service
from tests.experiments import cancel, listed, submit_one, toy
from tests.filling import fill
from tests.made_studies import Made, Study, make

STUDY = Path(__file__).parents[2] / "docs" / "studies" / "figure-4-mujoco.zip"

RISING = [0.5 + 0.03 * number for number in range(11)]
CURVES = {"simulated_fit": Made(RISING), "known_fit": Made([0.9] * 11), "direct": Made([1.0])}

_CHROMIUM = pytest.StashKey[Chromium]()


class Known(NamedTuple):
    """What is in the database of `api` from the beginning, besides thirty made-up studies.

    Attributes:
        study: the id of a study that has ended, of the strategies of `CURVES`.
        ids: its experiments.
        strider: the id of an ended experiment with a robot of every shape, and one iteration beside number 0.
    """

    study: str
    ids: list[str]
    strider: str


@pytest.fixture
def browser(request: pytest.FixtureRequest) -> Any:
    """One for all tests that follow each other with it."""
    stash = request.session.stash
    if _CHROMIUM not in stash:
        stash[_CHROMIUM] = Chromium()
    return stash[_CHROMIUM]


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Close the browser before a test without it: Playwright keeps an event loop running, where no other can run."""
    stash = item.session.stash
    if _CHROMIUM in stash and "browser" not in getattr(nextitem, "fixturenames", ()):
        stash[_CHROMIUM].close()
        del stash[_CHROMIUM]


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
def plugins(folder: Path) -> Path:
    """The folder with the robot that has every shape."""
    home = folder / "plugins"
    home.mkdir()
    for name, text in FILES.items():
        (home / f"{name}.py").write_text(text)
    return home


@pytest.fixture(scope="session")
def known(written_file: Path, plugins: Path) -> Known:
    """What is in the database of `api` from the beginning."""
    loading.load((plugins,))
    store = Store(f"sqlite:///{written_file}")
    fill(store, 210)
    study = make(store, "a study", Study(CURVES, repetitions=4))
    strider = strode(store, iterations=2)
    cancel(store, submit_one(store, toy(name="given up")).id)
    store.dispose()
    loading.load(())
    return Known(study.id, [each.id for each in study.experiments], strider)


@pytest.fixture(scope="session")
def api(written_file: Path, folder: Path, plugins: Path, known: Known) -> Iterator[Any]:
    """The API alone, on a database that tests fill as workers would."""
    api = Api(f"sqlite:///{written_file}", folder / "written.log", plugins=plugins).start()
    yield api
    api.close()


@pytest.fixture
def written(written_file: Any) -> Iterator[Any]:
    """The database of `api`, in which nothing is queued when a test begins."""
    store = Store(f"sqlite:///{written_file}")
    yield store
    for each in listed(store):
        if not each.state.ended:
            cancel(store, each.id)
    store.dispose()


@pytest.fixture(scope="session")
def archive(folder: Path, sqlite_template: Path) -> Iterator[Any]:
    """The API on a database with thirty made-up studies, a published one and a cancelled experiment."""
    file = folder / "archive.db"
    shutil.copy(sqlite_template, file)
    store = Store(f"sqlite:///{file}")
    fill(store, 210)
    with STUDY.open("rb") as archived:
        import_archive(store, archived)
    cancel(store, submit_one(store, toy(name="given up")).id)
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
