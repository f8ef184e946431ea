"""Supervisors on a real Ray: they obey the verbs, take turns, and two of them do nothing twice."""

import os
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from functools import cache
from pathlib import Path
from threading import Event
from typing import Any

import psutil
import pytest
from sqlalchemy import text

from gaplab.schemas.lifecycle import Ending, State, Verb
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.loop import repetition
from gaplab.services.experiments import lifecycle, reading
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.store.models import RepetitionRow
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Store
from gaplab.workers.ray_tasks import RayTasks
from gaplab.workers.supervisor import Supervisor
from tests.experiments import cancel, submit_one
from tests.fakes import flat
from tests.processes import processes_of_ray
from tests.supervising import impatient
from tests.waiting import wait_until

DEADLINE_S = 180


pytestmark = pytest.mark.usefixtures("ray")


def spec(repetitions: Any, controller_evaluations: Any = 200) -> Any:
    """Work enough in each repetition for something to happen meanwhile."""
    budget = {"controller_evaluations": controller_evaluations, "selection_evaluations": 60}
    return ExperimentSpec.model_validate(
        {
            "strategy": "simulated_fit_and_informative",
            "robot": "toy_function",
            "iterations": 2,
            "repetitions": repetitions,
            "budget": budget | {"simulator_evaluations": 60},
        }
    )


@cache
def expected(repetitions: Any) -> Any:
    resolved = resolve_experiment(spec(repetitions))
    return [[flat(step) for step in repetition(setting(resolved, number))] for number in range(repetitions)]


def stored(store: Store, experiment: Any) -> Any:
    with store.reading() as session:
        rows = session.query(RepetitionRow).filter_by(experiment_id=experiment).order_by(RepetitionRow.number).all()
        found = logs(session, [row.id for row in rows])
        return [[flat(step) for step in found[row.id]] for row in rows]


def state(store: Store, experiment: Any) -> Any:
    return reading.read_experiment(store, experiment).state


def attempts(store: Store, experiment: Any, repetitions: Any) -> Any:
    return [each for number in range(repetitions) for each in reading.list_attempts(store, experiment, number)]


def test_a_paused_experiment_gives_its_cores_back_and_goes_on_with_the_same_numbers(store: Store) -> None:
    experiment = submit_one(store, spec(3)).id
    supervisor = Supervisor(store, lambda: 3, RayTasks())
    wait_until(lambda: len(stored(store, experiment)[0]) > 1, meanwhile=supervisor.step)

    lifecycle.ask(store, experiment, Verb.PAUSE)
    wait_until(lambda: state(store, experiment) is State.PAUSED, meanwhile=supervisor.step)
    wait_until(lambda: not (supervisor.busy or processes_of_ray("run")), meanwhile=supervisor.step)
    paused = stored(store, experiment)
    for _ in range(3):
        supervisor.step()
    lifecycle.ask(store, experiment, Verb.RESUME)
    wait_until(lambda: state(store, experiment).ended, meanwhile=supervisor.step)

    found = stored(store, experiment)
    assert paused != found == expected(3)
    assert [log[: len(start)] for log, start in zip(found, paused, strict=True)] == paused
    assert Ending.PAUSED in {each.ending for each in attempts(store, experiment, 3)}


@pytest.mark.release
def test_a_stopped_experiment_is_completed_with_the_steps_that_were_under_way(sqlite_store: Store) -> None:
    experiment = submit_one(sqlite_store, spec(3)).id
    supervisor = Supervisor(sqlite_store, lambda: 3, RayTasks())
    done = lambda: reading.read_experiment(sqlite_store, experiment).progress.iterations_done  # noqa: E731
    wait_until(done, meanwhile=supervisor.step)

    lifecycle.ask(sqlite_store, experiment, Verb.STOP)
    wait_until(lambda: state(sqlite_store, experiment).ended, meanwhile=supervisor.step)

    found = stored(sqlite_store, experiment)
    assert state(sqlite_store, experiment) is State.COMPLETED
    assert found != expected(3)
    assert [log[: len(part)] for log, part in zip(expected(3), found, strict=True)] == found
    wait_until(lambda: not (supervisor.busy or processes_of_ray("run")), meanwhile=supervisor.step)


@pytest.mark.release
def test_a_small_experiment_starts_with_the_next_free_core_whatever_waits(sqlite_store: Store) -> None:
    large = submit_one(sqlite_store, spec(8)).id
    supervisor = Supervisor(sqlite_store, lambda: 4, RayTasks())
    wait_until(lambda: len(stored(sqlite_store, large)[0]) > 1, meanwhile=supervisor.step)
    small = submit_one(sqlite_store, spec(1, controller_evaluations=100)).id

    wait_until(lambda: state(sqlite_store, small).ended, meanwhile=supervisor.step)

    begun = [len(each) > 0 for each in stored(sqlite_store, large)]
    cancel(sqlite_store, large)
    wait_until(lambda: not (supervisor.busy or processes_of_ray("run")), meanwhile=supervisor.step)
    assert not all(begun)


def test_two_supervisors_on_one_database_do_nothing_twice(store: Store) -> None:
    ids = [submit_one(store, spec(2)).id for _ in range(2)]
    stop = Event()

    with ThreadPoolExecutor(2) as pool:
        ends = [pool.submit(Supervisor(store, lambda: 2, RayTasks()).serve, stop) for _ in range(2)]
        try:
            wait_until(lambda: all(state(store, each).ended for each in ids))
        finally:
            stop.set()

    assert [each.result() for each in ends] == [None, None]
    assert [stored(store, each) for each in ids] == [expected(2)] * 2
    tried = [each for experiment in ids for each in attempts(store, experiment, 2)]
    assert len({each.owner for each in tried}) == 2
    assert sum(each.ending is Ending.COMPLETED for each in tried) == 4


def stop_outside_transactions(store: Store, pid: int) -> None:
    """Stop a process while it holds no lock: one that slept while it read would let nobody write in SQLite."""
    if not store.file:
        wait_until(lambda: stops_idle(store, pid), meanwhile=lambda: os.kill(pid, signal.SIGCONT))
        return
    with closing(sqlite3.connect(store.file, timeout=DEADLINE_S, isolation_level=None)) as connection:
        connection.execute("BEGIN EXCLUSIVE")
        os.kill(pid, signal.SIGSTOP)
        wait_until(lambda: psutil.Process(pid).status() == psutil.STATUS_STOPPED)


def stops_idle(store: Store, pid: int) -> bool:
    """Stop a process, and say whether nobody else is in a transaction of Postgres."""
    os.kill(pid, signal.SIGSTOP)
    busy = text("SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() AND xact_start < now()")
    with store.reading() as session:
        return not session.scalar(busy)


@pytest.fixture
def other(store_url: str, tmp_path: Path) -> Iterator[Any]:
    """A supervisor in a process of its own, with a Ray of its own, and what it says."""
    said = tmp_path / "other.log"
    with said.open("w") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.supervising", store_url],
            cwd=Path(__file__).parents[2],
            stderr=log,
            stdout=log,
        )
    yield process, said
    process.send_signal(signal.SIGCONT)
    process.terminate()
    try:
        process.wait(60)
    except subprocess.TimeoutExpired:
        process.kill()


@pytest.mark.release
def test_a_supervisor_that_slept_past_its_lease_writes_nothing_any_more(
    store: Store, other: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    impatient(monkeypatch.setattr)
    process, said = other
    experiment = submit_one(store, spec(2)).id
    wait_until(lambda: len(stored(store, experiment)[0]) > 1)

    stop_outside_transactions(store, process.pid)
    ours = Supervisor(store, lambda: 2, RayTasks())
    wait_until(lambda: state(store, experiment).ended, meanwhile=ours.step)
    ended = stored(store, experiment)
    os.kill(process.pid, signal.SIGCONT)
    wait_until(lambda: "no longer holds its lease" in said.read_text())

    tried = attempts(store, experiment, 2)
    assert ended == stored(store, experiment) == expected(2)
    assert (tried[0].ending, tried[0].reason) == (Ending.LOST, "its worker was not heard of for 3 s")
    assert len({each.owner for each in tried}) == 2
    assert [each.ending for each in tried if each.owner != tried[0].owner] == [Ending.COMPLETED] * 2
    assert execution.claim(store, "nobody", 9) == ()
