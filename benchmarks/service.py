"""Whole repetitions through Ray and the database on two cores, against one core and against what users write."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import migrations
from benchmarks import naive
from benchmarks.measure import Row, rates, ratio
from schemas.sensitivity import SensitivitySpec
from schemas.spec import ExperimentSpec
from services import experiments, sensitivity
from services.core.loop import repetition
from services.core.types import Selected, Transferred, Tuned
from services.resolution import expected_rollouts, resolve_experiment
from services.settings import Settings
from services.simulation import setting
from services.store.session import Store
from workers.cluster import cluster
from workers.supervisor import Supervisor

SPEC = ExperimentSpec.model_validate(
    {
        "strategy": "simulated_fit",
        "iterations": 1,
        "repetitions": 6,
        "budget": {"controller_evaluations": 60, "selection_evaluations": 60, "simulator_evaluations": 60},
    }
)
CORES = 2


@contextmanager
def service() -> Iterator[Callable[[], int]]:
    """The whole experiment, submitted to a store and run by a supervisor on Ray; its rollouts."""
    with TemporaryDirectory() as folder:
        url = f"sqlite:///{Path(folder) / 'bench.db'}"
        migrations.upgrade(url)
        store = Store(url)
        with cluster(Settings(database_url=url, workers=CORES)) as capacity:
            supervisor = Supervisor(store, capacity)
            _check(store, supervisor)

            def work() -> int:
                experiment = experiments.submit_experiment(store, SPEC).id
                while not (read := experiments.read_experiment(store, experiment)).state.ended:
                    supervisor.step()
                return read.progress.rollouts_done

            yield work
        store.dispose()


def _check(store: Store, supervisor: Supervisor) -> None:
    """Run the sensitivity check that comes with the first such experiment, which is no part of what is measured."""
    check = sensitivity.submit(store, SensitivitySpec()).id
    while not sensitivity.read(store, check).state.ended:
        supervisor.step()


def in_one_process() -> int:
    """The same repetitions through `Simulate` on one core, with nothing around them; their rollouts."""
    spec = resolve_experiment(SPEC)
    steps = [step for number in range(spec.repetitions or 0) for step in repetition(setting(spec, number))]
    return sum(step.cost.rollouts for step in steps if isinstance(step, Selected | Tuned | Transferred))


def rows(rounds: int) -> list[Row]:
    """The service against one core, and against what a user would write on as many cores."""
    spec = resolve_experiment(SPEC)
    total = expected_rollouts(spec) * (spec.repetitions or 0)
    with service() as through_the_service, naive.pool(CORES) as processes:
        rivals = {"one": in_one_process, "service": through_the_service, "naive": naive.work(processes)}
        measured = rates(rivals, rounds)
    rate = {name: f"{float(np.median(each)):.1f} rollouts/s" for name, each in measured.items()}
    speedup, gain = ratio(measured["service"], measured["one"]), ratio(measured["service"], measured["naive"])
    return [
        Row(f"engine, {total} rollouts of whole repetitions, one core", rate["one"]),
        Row("service: the same through Ray and SQLite, two cores", rate["service"], speedup, "engine", "≥ 1.85"),
        Row("what a user would write, two processes", rate["naive"]),
        Row("service, as above", rate["service"], gain, "what a user would write", "≥ 3"),
    ]
