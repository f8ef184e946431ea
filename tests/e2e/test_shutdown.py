"""The service is told to stop while steps that take long are under way."""

import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text

from gaplab.services.store.session import Store
from tests.e2e.service import Service
from tests.waiting import wait_until

LONG_STEPS = {
    "robot": "toy_function",
    "strategies": ["random"],
    "iterations": 1,
    "repetitions": 6,
    "budget": {"controller_evaluations": 2_000_000, "selection_evaluations": 20, "simulator_evaluations": 20},
}


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Any]:
    service = Service(tmp_path)
    yield service
    service.close()


def test_told_to_stop_it_hands_back_what_is_under_way_and_nothing_of_it_stays(service: Any, tmp_path: Path) -> None:
    service.start()
    study = service.post("/studies", LONG_STEPS)["id"]
    experiment = service.get(f"/studies/{study}")["experiments"][0]["id"]
    wait_until(lambda: steps_of(tmp_path) > 0)

    begun = time.monotonic()
    service.stop(signal.SIGTERM)
    took_s = time.monotonic() - begun

    wait_until(lambda: not service.processes(), otherwise=service.processes)
    assert took_s < 40
    store = Store(f"sqlite:///{tmp_path / 'gaplab.db'}")
    with store.reading() as session:
        of_it = "FROM repetition WHERE experiment_id = :id"
        rows = session.execute(text(f"SELECT state, attempts, losses {of_it}"), {"id": experiment}).all()
        parts = session.execute(text("SELECT count(*) FROM checkpoint")).scalar_one()
    store.dispose()
    assert rows == [("QUEUED", 0, 0)] * 6
    assert parts > 0


def steps_of(folder: Path) -> Any:
    store = Store(f"sqlite:///{folder / 'gaplab.db'}")
    with store.reading() as session:
        found = session.execute(text("SELECT sum(steps) FROM repetition")).scalar_one()
    store.dispose()
    return found or 0
