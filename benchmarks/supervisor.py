"""Steps per second that the supervisor stores on SQLite and Postgres, from 1 000 repetitions with free workers."""

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

AT_ONCE = 200
"""Simultaneous repetitions: as many as for a hundred cores."""

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

Batches = tuple[Batch, ...]


def simulated() -> Batches:
    """Return the batches of steps of one repetition, which every simulated repetition delivers."""
    return tuple(batches(recorded(setting(resolve_experiment(SPEC), 0), (), ())))


class WithoutRay(Repetitions):
    """Repetitions without workers: each round, every repetition has its next batch ready."""

    def __init__(self, store: Store, delivered: Batches) -> None:
        super().__init__(store, "benchmark", {})
        self._delivered = delivered

    def launch(self, claim: Claim) -> Run:
        """Deliver precomputed batches; the claim's log is empty."""
        return Run(claim, iter(self._delivered))

    def receive(self) -> None:
        """Take the next batch of each run."""
        for run in self.runs:
            batch = next(run.stream, None)
            run.ended = batch is None
            run.take(batch or ())


class ThroughRay(Repetitions):
    """Repetitions as Ray tasks that stream precomputed batches."""

    def __init__(self, store: Store, delivered: Batches) -> None:
        super().__init__(store, "benchmark", {})
        self._delivered = ray.put(delivered)

    def launch(self, claim: Claim) -> Run:
        """Stream precomputed batches through Ray."""
        return Run(claim, _deliver.remote(self._delivered))


@ray.remote(num_cpus=1, max_retries=0, num_returns="streaming")
def _deliver(delivered: Batches) -> Iterator[Batch]:
    yield from (batch for batch in delivered)  # Ray requires a generator


def steps_per_second(url: str, kind: type[WithoutRay] | type[ThroughRay], delivered: Batches) -> float:
    """Run a queued experiment to its end; return steps per second."""
    migrations.upgrade(url)
    store = Store(url)
    experiment = submission.submit_experiment(store, SPEC).id
    ours = Supervisor(store, lambda: AT_ONCE)
    ours._repetitions = kind(store, delivered)
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
    """Measure storing alone, and with Ray in the loop."""
    delivered = simulated()
    measured = []
    for name, kind in (("storing alone", WithoutRay), ("with Ray in the loop", ThroughRay)):
        with TemporaryDirectory() as folder, running(Path(folder)) as server, cluster(Settings(workers=2)):
            for database, url in (("SQLite", f"sqlite:///{Path(folder) / 'bench.db'}"), ("Postgres", server)):
                rate = steps_per_second(url, kind, delivered)
                measured.append(Row(f"supervisor, {name}, {database}", f"{rate:.0f} steps/s"))
    return measured


if __name__ == "__main__":
    for row in rows():
        print(row.figure, row.value)
