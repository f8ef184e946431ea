"""A whole experiment through HTTP, Ray and the database on two cores, against the same through `Simulate` alone."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from time import sleep

import numpy as np

from benchmarks import naive
from benchmarks.measure import Row, rates, ratio
from gaplab.api.process.local_service import start_service
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Selected, Transferred, Tuned
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment

SPEC = ExperimentSpec.model_validate(
    {
        "strategy": "simulated_fit",
        "iterations": 1,
        "repetitions": 8,
        "budget": {"controller_evaluations": 120, "selection_evaluations": 120, "simulator_evaluations": 120},
    }
)
CORES = 2
LOOK_S = 0.5
"""Interval between looks at the progress: each takes 10 ms of the cores that the experiment needs."""


@contextmanager
def service() -> Iterator[Callable[[], int]]:
    """Start a real service; yield work that runs the experiment and returns its rollouts."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        with start_service(f"sqlite:///{folder / 'bench.db'}", folder / "service.log") as client:
            client.check({})  # the sensitivity check would run with the first experiment, and is not measured

            def work() -> int:
                submitted = client.submit(SPEC.model_dump(mode="json", exclude_unset=True)).id
                while not (read := client.find(submitted)).state.ended:
                    sleep(LOOK_S)
                return read.progress.rollouts_done

            yield work


def one_repetition(number: int) -> int:
    """Run a repetition through `Simulate` alone; return its rollouts."""
    return sum(
        step.cost.rollouts
        for step in repetition(setting(_resolved(), number))
        if isinstance(step, Selected | Tuned | Transferred)
    )


@cache
def _resolved() -> ResolvedSpec:
    return resolve_experiment(SPEC)


def rows(rounds: int) -> list[Row]:
    """Measure the service against one core, two bare cores, and a user's own script on two cores."""
    numbers = range(SPEC.repetitions or 0)
    with service() as through_the_service, naive.pool(CORES) as users, get_context("spawn").Pool(CORES) as bare:
        competitors = {
            "one": lambda: sum(map(one_repetition, numbers)),
            "two": lambda: sum(bare.map(one_repetition, numbers, chunksize=1)),
            "service": through_the_service,
            "naive": naive.work(users),
        }
        measured = rates(competitors, rounds)
    rate = {name: f"{float(np.median(each)):.1f} rollouts/s" for name, each in measured.items()}
    whole, two = measured["service"], measured["two"]
    return [
        Row(f"engine: {len(numbers)} whole repetitions, one core", rate["one"]),
        Row(
            "engine: the same in two processes", rate["two"], ratio(two, measured["one"]), "one", "2 if cores are free"
        ),
        Row(
            "service: the same through HTTP, Ray, SQLite", rate["service"], ratio(whole, two), "two processes", "≥ 0.93"
        ),
        Row("service, as above", rate["service"], ratio(whole, measured["one"]), "engine, one core", "≥ 1.85"),
        Row("a user's own script, two processes", rate["naive"]),
        Row("service, as above", rate["service"], ratio(whole, measured["naive"]), "a user's own script", "≥ 3"),
    ]


if __name__ == "__main__":
    for row in rows(2):
        print(row.figure, row.value, row.ratio)
