"""Fixtures of tests that ask a service over HTTP: `url` is where it answers, `gaplab` is the command that asks it."""

import io
import sys
from collections.abc import Iterator

import pytest
from fastapi import FastAPI

from api.app import create_app
from api.cli import main
from services.store.session import Store
from tests.commands import Gaplab, Said, served


@pytest.fixture(scope="module")
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
def gaplab(url: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Gaplab:
    """Runs the command as a shell would."""
    monkeypatch.setenv("GAPLAB_URL", url)

    def command(*arguments: str, stdin: str = "") -> Said:
        monkeypatch.setattr(sys, "argv", ["gaplab", *arguments])
        monkeypatch.setattr(sys, "stdin", io.StringIO(stdin))
        with pytest.raises(SystemExit) as ended:
            main()
        printed = capsys.readouterr()
        assert "Traceback" not in printed.out + printed.err
        return Said(int(ended.value.code or 0), printed.out, printed.err)

    return command
