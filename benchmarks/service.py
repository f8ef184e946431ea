"""Whole experiments through HTTP, Ray and the database on two cores, against the same through `Simulate` alone.

One has a repetition for each core and more; the other is one repetition, whose rollouts the cores share.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from time import sleep
from typing import Any

from benchmarks.measure import Row, compared
from gaplab.api.clients.client import Client
from gaplab.api.process.local_service import start_service
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Selected, Transferred, Tuned
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment

MANY: Mapping[str, Any] = {
    "strategy": "simulated_fit",
    "iterations": 1,
    "repetitions": 8,
    "budget": {"controller_evaluations": 120, "selection_evaluations": 120, "simulator_evaluations": 120},
}
SHARED = {"controller_evaluations": 160, "selection_evaluations": 160, "simulator_evaluations": 40}
ONE = {**MANY, "strategy": "informative", "repetitions": 1, "budget": SHARED}
"""Its selection has nine tenths of the rollouts, 20 a newcomer, as at the paper's budgets."""
COMPARED = (
    ("8 repetitions in two processes", "8 repetitions on one core", "2 if cores are free"),
    ("8 repetitions through HTTP, Ray, SQLite", "8 repetitions in two processes", "≥ 0.93"),
    ("8 repetitions through HTTP, Ray, SQLite", "8 repetitions on one core", "≥ 1.85"),
    ("one repetition of informative through them", "one on one core", "≥ 1.7"),
)
CORES = 2
LOOK_S = 0.5
"""Interval between looks at the progress: each takes 10 ms of the cores that the experiment needs."""


@contextmanager
def service() -> Iterator[Client]:
    """Start a real service."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        with start_service(f"sqlite:///{folder / 'bench.db'}", folder / "service.log") as client:
            client.check({})  # the sensitivity check would run with the first experiment, and is not measured
            yield client


def through(client: Client, spec: Mapping[str, Any]) -> Callable[[], int]:
    """Return work: the experiment through the service."""

    def work() -> int:
        submitted = client.submit(dict(spec)).id
        while not (read := client.study(submitted)).state.ended:
            sleep(LOOK_S)
        return read.progress.rollouts_done

    return work


def alone(number: int, spec: Mapping[str, Any] = MANY) -> int:
    """Run a repetition through `Simulate` alone; return its rollouts."""
    steps = repetition(setting(resolve_experiment(ExperimentSpec.model_validate(spec)), number))
    return sum(step.cost.rollouts for step in steps if isinstance(step, Selected | Tuned | Transferred))


def rows(rounds: int) -> list[Row]:
    """Measure the service against one core and two bare cores."""
    numbers = range(MANY["repetitions"])
    with service() as client, get_context("spawn").Pool(CORES) as bare:
        competitors = {
            "8 repetitions on one core": lambda: sum(map(alone, numbers)),
            "8 repetitions in two processes": lambda: sum(bare.map(alone, numbers, chunksize=1)),
            "8 repetitions through HTTP, Ray, SQLite": through(client, MANY),
            "one on one core": lambda: alone(0, ONE),
            "one repetition of informative through them": through(client, ONE),
        }
        return compared(competitors, COMPARED, rounds)
