"""Fixtures of tests that ask a service over HTTP: `url` is where it answers, `gaplab` is the command that asks it,
and `finish` computes what was submitted."""

import io
import shlex
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pexpect
import pytest
from fastapi import FastAPI

from gaplab.api.app import create_app
from gaplab.api.commands.cli import main
from gaplab.services.store.session import Store
from tests import experiments
from tests.commands import Gaplab, Said, served


@pytest.fixture(scope="session")
def service() -> Iterator[tuple[FastAPI, str]]:
    """A service without workers, and without a database yet."""
    app = create_app(Store("sqlite://"))
    with served(app) as address:
        yield app, address


@pytest.fixture
def url(service: tuple[FastAPI, str], sqlite_store: Store) -> str:
    """Where the service answers from this test's database."""
    app, address = service
    app.state.store = sqlite_store
    return address


@pytest.fixture
def other(request: pytest.FixtureRequest, store: Store, sqlite_template: Path, tmp_path: Path) -> Iterator[Store]:
    """Another database than that of `store`: of the other kind in a test of `dialects`, else SQLite."""
    if store.file and request.node.get_closest_marker("dialects"):
        yield request.getfixturevalue("postgres_store")
        return
    opened = Store(f"sqlite:///{shutil.copy(sqlite_template, tmp_path / 'other.db')}")
    yield opened
    opened.dispose()


@pytest.fixture
def gaplab(url: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Gaplab:
    """Runs the command as a shell would, with these variables in the environment."""

    def command(*arguments: str, stdin: str = "", **environment: str) -> Said:
        with monkeypatch.context() as shell:
            shell.setattr("sys.stdin", io.StringIO(stdin))
            for name, value in {"GAPLAB_URL": url, **environment}.items():
                shell.setenv(name, value)
            with pytest.raises(SystemExit) as ended:
                main(arguments)
        printed = capsys.readouterr()
        assert "Traceback" not in printed.out + printed.err
        return Said(int(ended.value.code or 0), printed.out, printed.err)

    return command


@pytest.fixture
def at_a_terminal(url: str) -> Callable[[str, str, str], pexpect.spawn]:
    """Runs a line of a shell at a terminal, where `gaplab` is the command, and answers its question."""

    def start(line: str, question: str, answer: str) -> pexpect.spawn:
        command = f"{shlex.quote(sys.executable)} -m gaplab"
        child = pexpect.spawn(
            "sh", ["-c", line.replace("gaplab", command)], env={"GAPLAB_URL": url, "PATH": "/usr/bin:/bin"}, timeout=120
        )
        child.expect_exact(question)
        child.sendline(answer)
        child.expect(pexpect.EOF)
        child.close()
        return child

    return start


@pytest.fixture
def finish(sqlite_store: Store) -> Callable[[], None]:
    """Runs whatever is queued."""
    return lambda: experiments.finish(sqlite_store)
