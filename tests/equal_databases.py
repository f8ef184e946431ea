"""New databases with the same contents: copies of one, on SQLite or on a Postgres server."""

import shutil
from itertools import count
from pathlib import Path

import psycopg

from gaplab import migrations
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.store.session import Store
from tests.experiments import submit_one


class Databases:
    """New databases in which an experiment is queued.

    Args:
        folder: for SQLite files.
        server: URL of a Postgres server; None: SQLite.
        spec: of the experiment.
    """

    def __init__(self, folder: Path, server: str | None, spec: ExperimentSpec) -> None:
        self._folder = folder
        self._server = server
        self._numbers = count()
        self._template = self._url("template")
        if server:
            self._execute('CREATE DATABASE "kill_template"')
        migrations.upgrade(self._template)
        store = Store(self._template)
        submit_one(store, spec)
        store.dispose()

    def new(self) -> str:
        """The URL of one."""
        name = str(next(self._numbers))
        if self._server:
            self._execute(f'CREATE DATABASE "kill_{name}" TEMPLATE "kill_template"')
        else:
            shutil.copy(self._folder / "template.db", self._folder / f"{name}.db")
        return self._url(name)

    def drop(self, url: str) -> None:
        """It is of no use any more."""
        if self._server:
            self._execute(f'DROP DATABASE "{url.partition("?")[0].rpartition("/")[2]}" WITH (FORCE)')

    def close(self) -> None:
        """Drop the template."""
        self.drop(self._template)

    def _url(self, name: str) -> str:
        if not self._server:
            return f"sqlite:///{self._folder / name}.db"
        place, mark, query = self._server.partition("?")
        return f"{place.rpartition('/')[0]}/kill_{name}{mark}{query}"

    def _execute(self, statement: str) -> None:
        assert self._server
        with psycopg.connect(self._server, autocommit=True) as connection:
            connection.execute(statement)
