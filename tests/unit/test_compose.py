"""The containers: their passwords and settings."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import psycopg.pq
import pytest
import yaml

from gaplab.services.store.engine import open_engine, parse

FILE = Path(__file__).parents[2] / "docker-compose.yml"
OF_GAPLAB = ("migrate", "api", "worker")


@pytest.fixture(scope="module")
def services() -> Any:
    return yaml.safe_load(FILE.read_text())["services"]


def test_the_password_is_in_no_address_and_is_the_same_everywhere(services: Any) -> None:
    for name in OF_GAPLAB:
        environment = services[name]["environment"]
        url = environment["GAPLAB_DATABASE_URL"]
        assert "$" not in url
        assert (parse(url).username, parse(url).password) == ("gaplab", None)
        assert environment["PGPASSWORD"] == services["db"]["environment"]["POSTGRES_PASSWORD"]


def test_the_driver_takes_the_password_of_the_environment(monkeypatch: pytest.MonkeyPatch, services: Any) -> None:
    monkeypatch.setenv("PGPASSWORD", "p@ss/100%")
    engine = open_engine(services["api"]["environment"]["GAPLAB_DATABASE_URL"])

    _, given = engine.dialect.create_connect_args(engine.url)

    defaults = {option.keyword: option.val for option in psycopg.pq.Conninfo.get_defaults()}
    assert "password" not in given
    assert defaults[b"password"] == b"p@ss/100%"


def test_optional_settings_reach_every_service_of_gaplab_and_the_host_stays(services: Any) -> None:
    for name in OF_GAPLAB:
        assert services[name]["env_file"] == [{"path": "gaplab.env", "required": False}]
    assert services["api"]["environment"]["GAPLAB_HOST"] == "0.0.0.0"


@pytest.mark.parametrize(
    ("arguments", "status", "told"),
    [(["check"], 1, "the database cannot be used now"), ([], 2, "usage: "), (["check", "now"], 2, "usage: ")],
)
def test_the_check_of_a_worker_says_that_its_database_cannot_be_used(
    services: Any, tmp_path: Path, arguments: list[str], status: int, told: str
) -> None:
    command = [sys.executable, *services["worker"]["healthcheck"]["test"][2:-1], *arguments]
    environment = os.environ | {"GAPLAB_DATABASE_URL": f"sqlite:///{tmp_path / 'gone.db'}"}

    done = subprocess.run(command, cwd=FILE.parent, env=environment, capture_output=True, text=True, check=False)

    assert (done.returncode, done.stderr.startswith(told)) == (status, True), done.stderr
