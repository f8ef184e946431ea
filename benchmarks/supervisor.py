"""Steps per second that the supervisor stores on SQLite and Postgres, from 1 000 repetitions that cost nothing."""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import ray

from benchmarks.measure import Row
from gaplab import migrations
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.experiments import reading, submission
from gaplab.services.running.execution import Claim
from gaplab.services.settings import Settings
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.store.session import Store
from gaplab.workers.checkpoints import recorded
from gaplab.workers.cluster import cluster
from gaplab.workers.repetitions import Repetitions
from gaplab.workers.run import Run
from gaplab.workers.supervisor import Supervisor
from gaplab.workers.task import Batch, batches
from tests.postgres import running

AT_ONCE = 200  # simultaneous repetitions, as many as for a hundred cores

SPEC = ExperimentSpec.model_validate(
    {
        "strategy": "informative",
        "robot": "toy_function",
        "iterations": 2,
        "repetitions": 1_000,
        "budget": {"controller_evaluations": 20, "selection_evaluations": 20, "simulator_evaluations": 20},
    }
)
"""A spec with every kind of step, and with the largest ones to store: 20 simulators in each tuning."""


class Delivered(Repetitions):
    """Repetitions as Ray tasks that stream precomputed batches."""

    def __init__(self, store: Store, delivered: tuple[Batch, ...]) -> None:
        super().__init__(store, "benchmark", {})
        self._delivered = ray.put(delivered)

    def launch(self, claim: Claim) -> Run:
        """Stream precomputed batches through Ray."""
        return Run(claim, _deliver.remote(self._delivered))


@ray.remote(num_cpus=1, max_retries=0, num_returns="streaming")
def _deliver(delivered: tuple[Batch, ...]) -> Iterator[Batch]:
    yield from (batch for batch in delivered)  # Ray requires a generator


def steps_per_second(url: str, delivered: tuple[Batch, ...]) -> float:
    """Run a queued experiment to its end; return steps per second."""
    migrations.upgrade(url)
    store = Store(url)
    experiment = submission.submit_experiment(store, SPEC).id
    ours = Supervisor(store, lambda: AT_ONCE)
    ours._repetitions = Delivered(store, delivered)
    begun = perf_counter()
    idle = 0
    while idle < 2:  # one round ends the last repetition, another finds no more work
        ours.step()
        idle = 0 if ours.busy else idle + 1
    seconds = perf_counter() - begun
    assert reading.read_experiment(store, experiment).progress.completed == SPEC.repetitions
    store.dispose()
    return (SPEC.repetitions or 0) * sum(map(len, delivered)) / seconds


def rows() -> list[Row]:
    """Measure both databases."""
    delivered = tuple(batches(recorded(setting(resolve_experiment(SPEC), 0), (), ())))
    measured = []
    with TemporaryDirectory() as folder, running(Path(folder)) as server, cluster(Settings(workers=2)):
        for database, url in (("SQLite", f"sqlite:///{Path(folder) / 'bench.db'}"), ("Postgres", server)):
            measured.append(Row(f"supervisor, {database}", f"{steps_per_second(url, delivered):.0f} steps/s"))
    return measured
