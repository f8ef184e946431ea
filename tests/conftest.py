"""Fixtures of all tests.

`store` is a Store at head on SQLite; a test marked `dialects` runs on a real Postgres too, and with `--all` every test
does. `sqlite_store` is one on SQLite alone, for tests in which the database does not matter. `store_url` and
`sqlite_url` are the URLs of the same, and `database_url` is an empty database of either kind, for migrations. Each test
has a database of its own: a copy of one that was migrated once. All test processes share one Postgres server.
`ray` is a Ray with two cores that all tests which want one share. `tests/tiers.py` decides which tests a run has.
"""

import os
import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, chdir, contextmanager
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import psycopg
import pytest
from hypothesis import settings

from gaplab import migrations
from gaplab.services.plugins import loading
from gaplab.services.specs import assembly, robots
from gaplab.services.store.session import Store
from tests import postgres as servers
from tests import statements

pytest_plugins = ["tests.tiers"]

statements.share()
settings.register_profile("any machine", deadline=None)
settings.load_profile("any machine")

STARTS = 8
"""Most starts of a Ray, each of which has half a minute."""

_DATABASES = ("sqlite", "postgres")
_SHARED = pytest.StashKey[str]()
_numbers = count()


@contextmanager
def _folder_in_memory() -> Iterator[Path]:
    """A folder for databases, in memory if there is room: tests do not wait for a disk."""
    memory = Path("/dev/shm")
    roomy = memory.is_dir() and shutil.disk_usage(memory).free > 2**30
    with TemporaryDirectory(prefix="gaplab-", dir=memory if roomy else None) as made:
        yield Path(made)


@contextmanager
def _server() -> Iterator[str]:
    """The data folder of a Postgres server, with a database at head to copy."""
    with _folder_in_memory() as place:
        installation, data = servers.Installation(place), place / "postgres"
        installation.initialise(data)
        server = servers.Server(installation, data, fsync="off", max_connections=400)
        try:
            databases = Postgres(data)
            databases.execute("CREATE DATABASE template")
            migrations.upgrade(databases.url("template"))
            yield str(data)
        finally:
            server.stop()


@pytest.hookimpl(optionalhook=True)
def pytest_configure() -> None:
    """Let programs that tests start obey signals that this process ignores, as under `nohup` or in the background."""
    for number in (signal.SIGHUP, signal.SIGQUIT):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, lambda *_: None)  # a program that is started has no handlers


def pytest_configure_node(node: Any) -> None:
    """Start the server that all test processes share, and tell a new process where it is."""
    stash = node.config.stash
    if _SHARED not in stash:
        server = _server()
        stash[_SHARED] = server.__enter__()
        node.config.add_cleanup(lambda: server.__exit__(None, None, None))
    node.workerinput["postgres"] = stash[_SHARED]


class Postgres:
    """The databases of a running server."""

    def __init__(self, data: str | Path) -> None:
        self._data = data

    def url(self, name: str) -> str:
        return servers.url(self._data, name)

    def execute(self, statement: str) -> None:
        with psycopg.connect(self.url("postgres"), autocommit=True) as connection:
            connection.execute(statement)

    @contextmanager
    def database(self, template: str = "template1") -> Iterator[str]:
        """The URL of a new copy of a database, which is removed at the end."""
        name = f"test_{os.getpid()}_{next(_numbers)}"
        self.execute(f"CREATE DATABASE {name} TEMPLATE {template}")
        yield self.url(name)
        self.execute(f"DROP DATABASE {name} WITH (FORCE)")


@pytest.fixture(scope="session")
def folder() -> Iterator[Path]:
    """Where the databases of this process are."""
    with _folder_in_memory() as place:
        yield place


@pytest.fixture(scope="session")
def postgres(pytestconfig: pytest.Config) -> Iterator[Postgres]:
    """The server: the one that test processes share, or one of this process if it is alone."""
    shared = getattr(pytestconfig, "workerinput", {}).get("postgres")
    if shared:
        yield Postgres(shared)
        return
    with _server() as data:
        yield Postgres(data)


@pytest.fixture(scope="session")
def sqlite_template(folder: Path) -> Path:
    """A SQLite file at head, migrated once for all tests."""
    file = folder / "template.db"
    migrations.upgrade(f"sqlite:///{file}")
    return file


def filled(template: Path, fill: Callable[[Store], object]) -> Path:
    """A copy of a SQLite file with more in it; a module that has it as `sqlite_template` computes it once."""
    file = template.with_name(f"filled_{next(_numbers)}.db")
    shutil.copy(template, file)
    store = Store(f"sqlite:///{file}")
    fill(store)
    store.dispose()
    return file


@pytest.fixture(params=_DATABASES)
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """An empty database, on SQLite and on Postgres in turn."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path / 'empty.db'}"
        return
    with request.getfixturevalue("postgres").database() as url:
        yield url


@pytest.fixture
def sqlite_url(sqlite_template: Path) -> Iterator[str]:
    """A SQLite database at head."""
    file = sqlite_template.with_name(f"test_{next(_numbers)}.db")
    shutil.copy(sqlite_template, file)
    yield f"sqlite:///{file}"
    file.unlink()


@pytest.fixture(params=_DATABASES)
def store_url(request: pytest.FixtureRequest) -> Iterator[str]:
    """A database at head, on SQLite and on Postgres in turn."""
    if request.param == "sqlite":
        yield request.getfixturevalue("sqlite_url")
        return
    with request.getfixturevalue("postgres").database("template") as url:
        yield url


@pytest.fixture
def sqlite_store(sqlite_url: str) -> Iterator[Store]:
    """A store at head on SQLite."""
    yield from _opened(sqlite_url)


@pytest.fixture
def postgres_store(postgres: Postgres) -> Iterator[Store]:
    """A store at head on Postgres."""
    with postgres.database("template") as url:
        yield from _opened(url)


@pytest.fixture
def store(store_url: str) -> Iterator[Store]:
    """A store at head, on SQLite and on Postgres in turn."""
    yield from _opened(store_url)


def _opened(url: str) -> Iterator[Store]:
    store = Store(url)
    yield store
    store.dispose()


@pytest.fixture(scope="session")
def shared_ray() -> Iterator[ExitStack]:
    """Holds the Ray of this process, once it has one; a test that starts another one ends it first."""
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def ray(shared_ray: ExitStack) -> None:
    """This process has a Ray with two cores."""
    import ray  # takes a second

    from gaplab.services.settings import Settings
    from gaplab.workers.cluster import cluster
    from gaplab.workers.errors import ClusterUnusable

    tries = 0
    while not ray.is_initialized():
        shared_ray.close()
        tries += 1
        try:
            shared_ray.enter_context(cluster(Settings(workers=2)))
        except ClusterUnusable:  # a start that takes more than half a minute: the machine is busy
            if tries == STARTS:
                raise


@pytest.fixture
def plug_ins() -> Iterator[Callable[..., None]]:
    """Imports the plug-ins of folders, as the next process with these folders does."""
    before = loading.here()

    def restart(*folders: Path) -> None:
        loading.load(folders)
        assembly._warm_engine.cache_clear()
        robots._own_unit.cache_clear()

    yield restart
    restart(*(before.folders if before else ()))


@pytest.fixture
def put(tmp_path: Path, plug_ins: Callable[..., None]) -> Any:
    """Writes files into a plug-in folder, and imports what is in all such folders, as the next process does."""
    homes: list[Path] = []

    def write(folder: str = "mine", /, **files: str) -> Path:
        home = tmp_path / folder
        home.mkdir(exist_ok=True)
        for name, text in files.items():
            (home / f"{name}.py").write_text(text)
        homes.append(home)
        plug_ins(*homes)
        return home

    return write


@pytest.fixture
def here(tmp_path: Path) -> Iterator[Path]:
    """An empty folder, where the process is."""
    with chdir(tmp_path):
        yield tmp_path
