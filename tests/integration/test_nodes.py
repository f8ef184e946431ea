"""A Ray cluster of several nodes: the same numbers as in one process, whatever happens to a node.

With every change, test_workers.py checks the versions of a node, and test_plugin_edits.py those of plug-ins.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Event
from typing import Any

import pytest
import ray
from ray._raylet import GcsClient  # type: ignore[attr-defined]
from ray.autoscaler.v2.sdk import get_cluster_resource_state
from ray.cluster_utils import Cluster

from gaplab.arithmetic import FIXED
from gaplab.schemas.lifecycle import State
from gaplab.services.experiments import reading
from gaplab.services.settings import Settings
from gaplab.services.store.session import Store
from gaplab.workers import ray_tasks
from gaplab.workers.cluster import cluster
from gaplab.workers.errors import ClusterUnusable
from gaplab.workers.ray_tasks import RayTasks
from gaplab.workers.supervisor import Supervisor
from tests.arithmetic import told
from tests.experiments import submit_one
from tests.integration.test_workers import expected, run, stored, toy

pytestmark = pytest.mark.release

ROOT = Path(__file__).parents[2]
NODE = {"num_cpus": 1, "object_store_memory": 100 * 2**20}
SPEC = toy(repetitions=4, iterations=1, budget={"controller_evaluations": 3_000, "selection_evaluations": 500})
"""About a second of work in each repetition."""


@contextmanager
def by_hand() -> Iterator[None]:
    """An environment as of a person who starts a node, without what gaplab adds to its own."""
    with pytest.MonkeyPatch.context() as patch:
        for name in FIXED:
            patch.delenv(name, raising=False)
        yield


@pytest.fixture(scope="module")
def head(shared_ray: ExitStack) -> Iterator[Any]:
    """A cluster whose head computes nothing; it grows as the tests ask for nodes."""
    shared_ray.close()
    with by_hand():
        found = Cluster(initialize_head=True, head_node_args=NODE | {"num_cpus": 0, "include_dashboard": False})
    yield found
    found.shutdown()


@pytest.fixture
def joined(head: Any, request: pytest.FixtureRequest) -> Iterator[Any]:
    """A connection to the cluster with as many nodes of one core as the test asks for."""
    with by_hand():
        for _ in range(request.param - len(head.worker_nodes)):
            head.add_node(**NODE, wait=False)
        head.wait_for_nodes()
    with cluster(Settings(ray_address=head.address)) as connection:
        yield connection


@pytest.fixture(scope="module")
def in_one_process() -> Any:
    return expected(SPEC)


@pytest.fixture
def ran_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The ids of the nodes on which a repetition was begun; the latest is the last."""
    alone = ray_tasks.run._function  # type: ignore[attr-defined]

    @ray.remote(num_cpus=1, max_retries=0, num_returns="streaming")
    def noted(*given: Any) -> Iterator[Any]:
        (tmp_path / ray.get_runtime_context().get_node_id()).touch()
        yield from alone(*given)

    monkeypatch.setattr(ray_tasks, "run", noted)
    return lambda: [path.name for path in sorted(tmp_path.glob("?" * 56), key=lambda path: path.stat().st_mtime_ns)]


@pytest.mark.parametrize("joined", [0], indirect=True)
def test_without_cores_what_waits_is_a_demand_that_an_autoscaler_sees_and_runs_once_a_node_joins(
    joined: Any, head: Any, sqlite_store: Store
) -> None:
    experiment = submit_one(sqlite_store, toy()).id
    supervisor = Supervisor(sqlite_store, joined.capacity, RayTasks(joined.versions))
    gcs = GcsClient(address=head.address)

    run(supervisor, sqlite_store, experiment, until=lambda: demanded(gcs))
    with by_hand():
        head.add_node(**NODE)
    run(supervisor, sqlite_store, experiment)

    assert stored(sqlite_store, experiment) == expected(toy())


def demanded(gcs: Any) -> Any:
    """What the autoscaler of a cluster is told that tasks wait for."""
    waiting = get_cluster_resource_state(gcs).pending_resource_requests
    return [dict(each.request.resources_bundle) for each in waiting if each.count]


@pytest.mark.parametrize("joined", [2, 4], indirect=True)
def test_the_numbers_do_not_depend_on_how_many_nodes_there_are(
    joined: Any, sqlite_store: Store, ran_on: Any, in_one_process: Any, request: pytest.FixtureRequest
) -> None:
    count = request.node.callspec.params["joined"]
    experiment = submit_one(sqlite_store, SPEC).id

    run(Supervisor(sqlite_store, joined.capacity, RayTasks(joined.versions)), sqlite_store, experiment)

    assert joined.capacity() == 2 * count
    assert len(ran_on()) == count
    assert stored(sqlite_store, experiment) == in_one_process


@pytest.mark.parametrize("joined", [2], indirect=True)
def test_the_nodes_run_the_same_code_of_numpy_as_this_process(joined: Any) -> None:
    assert ray.get(ray.remote(told).remote()) == told()


@pytest.mark.parametrize("joined", [4], indirect=True)
def test_a_node_lost_in_the_middle_costs_no_result(
    joined: Any, head: Any, sqlite_store: Store, ran_on: Any, in_one_process: Any
) -> None:
    experiment = submit_one(sqlite_store, SPEC).id
    supervisor = Supervisor(sqlite_store, joined.capacity, RayTasks(joined.versions))
    run(supervisor, sqlite_store, experiment, until=lambda: len(ran_on()) == 4)

    (busy,) = (node for node in head.worker_nodes if node.node_id == ran_on()[-1])
    head.remove_node(busy, allow_graceful=False)
    run(supervisor, sqlite_store, experiment)

    repetitions = reading.list_repetitions(sqlite_store, experiment)
    assert [each.state for each in repetitions] == [State.COMPLETED] * 4
    assert sum(each.attempts for each in repetitions) > 4
    assert stored(sqlite_store, experiment) == in_one_process


@pytest.mark.parametrize("joined", [2], indirect=True)
def test_a_node_that_joins_with_other_versions_ends_the_work_before_a_step_of_it_is_stored(
    joined: Any, sqlite_store: Store
) -> None:
    experiment = submit_one(sqlite_store, toy()).id
    supervisor = Supervisor(sqlite_store, joined.capacity, RayTasks(joined.versions | {"gaplab": "0.0.1"}))

    with pytest.raises(ClusterUnusable, match=r"the supervisor has gaplab 0\.0\.1"):
        supervisor.serve(Event())

    repetitions = reading.list_repetitions(sqlite_store, experiment)
    assert {(each.state, each.attempts) for each in repetitions} == {(State.QUEUED, 0)}
    assert stored(sqlite_store, experiment) == [[], [], []]


WITH_A_TOKEN = """
import os, subprocess, sys, time
from ray.cluster_utils import Cluster
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.experiments import reading
from gaplab.services.store.session import Store
from tests.experiments import submit_one

spec = ExperimentSpec.model_validate_json(sys.argv[1])
store = Store(os.environ["GAPLAB_DATABASE_URL"])
experiment = submit_one(store, spec).id
head = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
os.environ["GAPLAB_RAY_ADDRESS"] = head.address
del os.environ["RAY_AUTH_MODE"]  # the supervisor's own default
with subprocess.Popen([sys.executable, "-m", "gaplab.workers", "serve"]) as supervisor:
    deadline = time.monotonic() + 60
    while not (state := reading.read_experiment(store, experiment).state).ended and time.monotonic() < deadline:
        time.sleep(0.1)
    supervisor.terminate()
head.shutdown()
print(state, supervisor.returncode)
"""


@pytest.fixture
def environment(tmp_path: Path, sqlite_url: str) -> Any:
    """Of a process that has nothing of this one's Ray, and a token of its own."""
    (tmp_path / "token").write_text("0123456789abcdef" * 4)
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("RAY_")}
    token = {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN_PATH": str(tmp_path / "token")}
    return inherited | token | {"GAPLAB_DATABASE_URL": sqlite_url, "PYTHONPATH": str(ROOT)}


def test_a_cluster_that_asks_for_a_token_is_given_it(environment: Any) -> None:
    call = [sys.executable, "-c", WITH_A_TOKEN, toy().model_dump_json()]

    done = subprocess.run(call, env=environment, cwd=ROOT, capture_output=True, text=True, timeout=100, check=False)

    assert done.stdout.splitlines()[-1] == "COMPLETED 0", done.stderr


def test_without_the_token_the_supervisor_says_so_and_ends(environment: Any, tmp_path: Path) -> None:
    (tmp_path / "token").unlink()
    call = [sys.executable, "-m", "gaplab.workers", "serve"]
    environment["GAPLAB_RAY_ADDRESS"] = "127.0.0.1:6379"

    done = subprocess.run(call, env=environment, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)

    assert done.returncode == 1
    assert "the Ray cluster at 127.0.0.1:6379 cannot be joined" in done.stderr
    assert "token" in done.stderr
