"""The real supervisor on a real Ray computes the kept numbers: with any number of workers, and if one is killed."""

import lzma
import os
import signal
import sqlite3
from pathlib import Path
from typing import Any

import pytest

from gaplab import migrations
from gaplab.schemas.lifecycle import State
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.archives import export
from gaplab.services.experiments import reading
from gaplab.services.running import execution
from gaplab.services.store.models import CheckpointRow
from gaplab.services.store.session import Store
from gaplab.workers.ray_tasks import RayTasks
from gaplab.workers.supervisor import Supervisor
from tests.experiments import listed, submit_one
from tests.numbers.keep import CHECKPOINTS
from tests.numbers.kept_numbers import HALF_WAY, archive, numbers, other_machine, tables
from tests.processes import processes_of_ray
from tests.waiting import wait_until

pytestmark = pytest.mark.usefixtures("ray")


def submit(store: Store, found: Any) -> Any:
    """Submit the kept specs; the ids of their experiments."""
    return [submit_one(store, ResolvedSpec.model_validate(each["spec"])).id for each in found["experiment"]]


def run(supervisor: Any, store: Store, ids: Any, until: Any = lambda: False) -> None:
    """Let the supervisor work until all experiments have ended, or the condition holds."""
    ended = lambda: all(reading.read_experiment(store, each).state.ended for each in ids)  # noqa: E731
    wait_until(lambda: ended() or until(), meanwhile=supervisor.step)


def stored(store: Store, ids: Any) -> Any:
    """The numbers of these experiments, by way of an archive."""
    found = []
    for each in ids:
        with export(store, each).file as file:
            found += numbers(tables(file.read()))
    return found


def assert_kept(computed: Any, kept: Any) -> None:
    if computed != kept and (other := other_machine()):
        pytest.skip(f"the numbers differ, and so does the machine: {other}")
    assert computed == kept


@pytest.mark.release
def test_any_number_of_workers_computes_the_kept_numbers(store: Store, store_url: str) -> None:
    at_once = 2 if store_url.startswith("sqlite") else 1
    studies = [tables(archive(name)) for name in ("analytic", "cma_es", "options")]
    ids = [submit(store, found) for found in studies]

    run(Supervisor(store, lambda: at_once, RayTasks()), store, [each for own in ids for each in own])

    for own, found in zip(ids, studies, strict=True):
        assert {reading.read_experiment(store, each).state for each in own} == {State.COMPLETED}
        assert_kept(stored(store, own), numbers(found))


@pytest.mark.release
def test_a_robot_among_idle_workers_has_the_kept_numbers(sqlite_store: Store) -> None:
    found = tables(archive("elsewhere"))
    ids = submit(sqlite_store, found)

    run(Supervisor(sqlite_store, lambda: 1, RayTasks()), sqlite_store, ids)

    assert_kept(stored(sqlite_store, ids), numbers(found))


def test_workers_killed_in_the_middle_of_a_step_cost_no_number(store: Store) -> None:
    found = tables(archive("long"))
    ids = submit(store, found)
    supervisor = Supervisor(store, lambda: 2, RayTasks(), checkpoint_s=0.01)
    run(supervisor, store, ids, until=lambda: in_the_middle(store))

    for pid in processes_of_ray("run"):
        os.kill(pid, signal.SIGKILL)
    run(supervisor, store, ids)

    assert sum(each.attempts for each in reading.list_repetitions(store, ids[0])) > 2
    assert_kept(stored(store, ids), numbers(found))


def in_the_middle(store: Store) -> Any:
    """Whether a part of a step is stored, which is deleted when the step is."""
    with store.reading() as session:
        return session.query(CheckpointRow).count()


@pytest.mark.release
def test_a_database_of_a_killed_supervisor_ends_with_the_kept_numbers(tmp_path: Path) -> None:
    file = tmp_path / "half-way.db"
    file.write_bytes(lzma.decompress(HALF_WAY.read_bytes()))
    connection = sqlite3.connect(file)
    assert connection.execute("SELECT count(*) FROM checkpoint").fetchone() == (CHECKPOINTS,)
    connection.close()
    migrations.upgrade(f"sqlite:///{file}")
    store = Store(f"sqlite:///{file}")
    ids = [each.id for each in listed(store)]
    execution.requeue_lost(store, stale_after_s=-1)

    run(Supervisor(store, lambda: 2, RayTasks()), store, ids)

    assert_kept(stored(store, ids), numbers(tables(archive("long"))))
    store.dispose()
