"""A supervisor that hangs is killed, one that dies is replaced at once, and `/readyz` tells of both."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from sqlalchemy import select, text, update

from gaplab.api.app import create_app
from gaplab.api.process.supervisor_process import Silence, SupervisorProcess
from gaplab.schemas.lifecycle import Ending
from gaplab.services.experiments import reading
from gaplab.services.running import execution, supervisors
from gaplab.services.running.pulse import PulsePipe
from gaplab.services.store.models import SupervisorRow
from gaplab.services.store.session import Store
from tests.experiments import submit_one, toy
from tests.waiting import wait_until

SOON = Silence(told_s=1, killed_s=3)

BEATING = """
import os, signal, sys, time
from gaplab.services.running import execution
from gaplab.services.running.pulse import PulsePipe
from gaplab.services.store.session import Store

pulse = PulsePipe.inherited()
pulse.name("kept")
with open(os.environ["NOTES"], "a") as notes:
    notes.write(f"{os.getpid()}\\n")
"""
STANDS_STILL = """
execution.claim(Store(os.environ["GAPLAB_DATABASE_URL"]), "kept", 1)
pulse.beat()
os.kill(os.getpid(), signal.SIGSTOP)
"""
DIES = """
pulse.beat()
pulse.explain("Ray died on this machine")
sys.exit(1)
"""
WAITS = """
for pulse.trouble in ["disk is full", "", "no worker\\nbegins"]:
    time.sleep(1.0)
    pulse.beat()
time.sleep(1000)
"""
LIVES = """
while True:
    pulse.beat()
    time.sleep(0.1)
"""


def test_a_supervisor_gives_its_first_sign_of_life_at_once_and_the_next_after_a_while() -> None:
    heard, told = os.pipe()
    pulse = PulsePipe(told)

    for _ in range(3):
        pulse.beat()
    pulse.name("me")
    os.close(told)

    assert os.read(heard, 100) == b".\nome\n"
    os.close(heard)


@pytest.fixture
def notes(tmp_path: Path) -> Path:
    """Where each supervisor notes its process id."""
    return tmp_path / "notes"


@pytest.fixture
def keep(tmp_path: Path, notes: Path, sqlite_store: Store) -> Iterator[Callable[..., SupervisorProcess]]:
    """Keeps a supervisor that does what a script says."""
    kept: list[SupervisorProcess] = []

    def keep(script: str, **times: float) -> SupervisorProcess:
        (tmp_path / "scripted.py").write_text(BEATING + script)
        root = Path(__file__).parents[2]
        environment = {"PYTHONPATH": f"{tmp_path}:{root / 'src'}:{root}", "NOTES": str(notes)}
        environment["GAPLAB_DATABASE_URL"] = f"sqlite:///{sqlite_store.file}"
        given: dict[str, Any] = {"silence": SOON, "store": sqlite_store, "longest_pause_s": 0.1}
        kept.append(SupervisorProcess(environment, module="scripted", **given | times))
        kept[-1].start()
        return kept[-1]

    yield keep
    for each in kept:
        each.stop()


@pytest.fixture
def app(sqlite_store: Store) -> FastAPI:
    return create_app(sqlite_store)


def pids(notes: Path) -> list[int]:
    return [int(line) for line in notes.read_text().split()] if notes.exists() else []


def readyz(app: FastAPI) -> Any:
    return TestClient(app).get("/readyz")


@pytest.mark.release
def test_a_supervisor_that_stands_still_is_killed_and_its_work_goes_to_another(
    keep: Callable[..., SupervisorProcess], notes: Path, app: FastAPI, sqlite_store: Store
) -> None:
    experiment = submit_one(sqlite_store, toy(repetitions=1)).id
    app.state.supervisor = keep(STANDS_STILL)

    wait_until(lambda: readyz(app).status_code == 503)
    told = readyz(app).json()
    wait_until(lambda: len(pids(notes)) > 1)

    assert told["type"] == "urn:gaplab:problem:supervisor-unavailable"
    assert "has not answered for" in told["detail"]
    assert "killed and started again" in told["detail"]
    assert not Path(f"/proc/{pids(notes)[0]}").exists()
    attempt = reading.list_attempts(sqlite_store, experiment, 0)[0]
    assert attempt.ending is Ending.LOST
    assert "did not answer" in str(attempt.reason)


def test_one_that_dies_again_and_again_is_told_with_its_reason(
    keep: Callable[..., SupervisorProcess], notes: Path, app: FastAPI
) -> None:
    app.state.supervisor = keep(DIES)

    wait_until(lambda: len(pids(notes)) > 1)
    wait_until(lambda: "Ray died on this machine" in readyz(app).text)
    wait_until(lambda: "times in a row" in readyz(app).text)
    wait_until(lambda: "exit code 1: Ray died on this machine" in readyz(app).text)
    wait_until(lambda: readyz(app).status_code == 503)


def test_one_that_lives_and_runs_nothing_tells_why(keep: Callable[..., SupervisorProcess], app: FastAPI) -> None:
    app.state.supervisor = keep(WAITS, silence=Silence())

    wait_until(lambda: readyz(app).json().get("detail") == "the supervisor waits: no worker begins")
    assert readyz(app).status_code == 503


@pytest.mark.release
def test_after_a_long_life_the_trouble_is_forgotten(
    keep: Callable[..., SupervisorProcess], notes: Path, app: FastAPI
) -> None:
    app.state.supervisor = keep(LIVES, long_life_s=1.0)
    wait_until(lambda: len(pids(notes)) == 1)

    os.kill(pids(notes)[0], signal.SIGKILL)
    wait_until(lambda: "exit code -9" in readyz(app).text)

    wait_until(lambda: readyz(app).json() == {"status": "ok"})
    assert len(pids(notes)) == 2


def test_a_silent_supervisor_of_another_process_is_told_as_a_warning(sqlite_store: Store, app: FastAPI) -> None:
    supervisors.heartbeat(sqlite_store, "elsewhere")
    well = readyz(app)
    app.state.lease_s = 0.1
    time.sleep(0.2)

    assert well.json() == {"status": "ok"}
    told = readyz(app)
    assert (told.status_code, told.json()["status"]) == (200, "degraded")
    assert "no supervisor has been heard of for" in told.json()["warnings"][0]


def test_work_without_any_supervisor_is_told(sqlite_store: Store, app: FastAPI) -> None:
    submit_one(sqlite_store, toy())

    assert "no supervisor runs them" in readyz(app).json()["warnings"][0]


@pytest.mark.dialects
def test_supervisors_that_die_again_and_again_elsewhere_are_told(store: Store) -> None:
    app = create_app(store)
    for name in ("first", "second", "third"):
        supervisors.heartbeat(store, name)
    store.write(lambda session: session.execute(text(_AGED[session.get_bind().dialect.name])))
    supervisors.heartbeat(store, "fourth")

    assert "3 supervisors died" in str(readyz(app).json()["warnings"])
    store.dispose()


_AGED = {
    "sqlite": "UPDATE supervisor SET heartbeat_at = strftime('%Y-%m-%d %H:%M:%f', 'now', '-2 minutes') || '000'",
    "postgresql": "UPDATE supervisor SET heartbeat_at = heartbeat_at - interval '2 minutes'",
}
_AHEAD = {
    "sqlite": "strftime('%Y-%m-%d %H:%M:%f', 'now', '+1 hour') || '000'",
    "postgresql": "clock_timestamp() + interval '1 hour'",
}


@pytest.mark.dialects
def test_a_clock_that_was_set_back_by_an_hour_stalls_nothing(store: Store) -> None:
    experiment = submit_one(store, toy(repetitions=1)).id
    (claim,) = execution.claim(store, "crashed", 1)
    supervisors.heartbeat(store, "crashed")
    for table in ("repetition", "supervisor"):
        ahead = f"UPDATE {table} SET heartbeat_at = {_AHEAD[store._engine.name]}"
        store.write(lambda session, statement: session.execute(text(statement)), ahead)

    requeued = execution.requeue_lost(store)
    (again,) = execution.claim(store, "other", 1)

    assert requeued == 1
    assert again.epoch == claim.epoch + 1
    assert reading.list_attempts(store, experiment, 0)[0].reason == "the clock was set back since its heartbeat"
    assert execution.heartbeat(store, [claim]) == ()
    told = readyz(create_app(store)).json()["warnings"][0]
    assert "no supervisor has been heard of" in told


def test_supervisors_of_long_ago_and_of_a_clock_far_ahead_are_forgotten(sqlite_store: Store) -> None:
    for name, days in {"old": -2, "ahead": 2}.items():
        present = supervisors.heartbeat(sqlite_store, name)
        moved = update(SupervisorRow).where(SupervisorRow.owner == name)
        moved = moved.values(heartbeat_at=present + timedelta(days=days))
        sqlite_store.write(lambda session, statement: session.execute(statement), moved)

    supervisors.heartbeat(sqlite_store, "new")

    with sqlite_store.reading() as session:
        assert session.scalars(select(SupervisorRow.owner)).all() == ["new"]


def test_a_clock_that_goes_back_a_little_loses_no_lease(store: Store) -> None:
    submit_one(store, toy(repetitions=1))
    (claim,) = execution.claim(store, "me", 1)

    assert execution.requeue_lost(store, stale_after_s=5) == 0
    assert execution.heartbeat(store, [claim]) == (claim,)
