"""Speed-up of one repetition of *informative* on two cores, beside that of two bare processes on this machine."""

from collections.abc import Callable
from statistics import median
from time import perf_counter, sleep
from typing import Any

import ray

from benchmarks.measure import Row, ratio
from benchmarks.physics import SWITCHING, genomes, simulation
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.loop import repetition
from gaplab.services.running.execution import Claim, TimedStep
from gaplab.services.settings import Settings
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.workers import task
from gaplab.workers.checkpoints import CHECKPOINT_S
from gaplab.workers.cluster import cluster

SPEC = ExperimentSpec.model_validate(
    {
        "strategy": "informative",
        "iterations": 1,
        "repetitions": 1,
        "budget": {"controller_evaluations": 160, "selection_evaluations": 160, "simulator_evaluations": 40},
    }
)
"""A spec whose selection has nine tenths of the rollouts, 20 for each newcomer, as at the paper's budgets."""

ROLLOUTS = 120
SETTLE_S = 1.0


@ray.remote(num_cpus=1)
def _alone() -> int:
    """Run the repetition on one core, even if others are idle."""
    return sum(1 for _ in repetition(setting(resolve_experiment(SPEC), 0)))


@ray.remote(num_cpus=1)
def _rollouts(count: int) -> int:
    """Run rollouts in one process."""
    simulate, drawn = simulation(), genomes()
    for index in range(count):
        simulate(drawn[[index % len(drawn)]], SWITCHING)
    return count


def alone() -> int:
    """Run the repetition in one process; return its number of steps."""
    return int(ray.get(_alone.remote()))


def on_all_cores() -> int:
    """Run the repetition as the service does; return its number of steps."""
    claim = Claim(id=0, epoch=0, experiment_id="none", number=0, spec=resolve_experiment(SPEC))
    stream: Any = task.run.remote(claim, {}, CHECKPOINT_S, None)
    return sum(isinstance(each, TimedStep) for batch in stream for each in ray.get(batch))


def bare(processes: int) -> Callable[[], int]:
    """Return work: rollouts divided among independent processes."""
    return lambda: sum(ray.get([_rollouts.remote(ROLLOUTS // processes) for _ in range(processes)]))


def settled(work: Callable[[], int]) -> float:
    """Return the duration of work in seconds, after Ray has noticed that the cores are idle."""
    sleep(SETTLE_S)
    begun = perf_counter()
    work()
    return perf_counter() - begun


def rows(rounds: int) -> list[Row]:
    """Measure the speed-up of a repetition and of bare processes in the same rounds."""
    competitors = {"one": alone, "two": on_all_cores, "bare one": bare(1), "bare two": bare(2)}
    taken: dict[str, list[float]] = {name: [] for name in competitors}
    with cluster(Settings(workers=2)):
        bare(2)()  # load the engines
        if on_all_cores() != alone():
            raise RuntimeError("the service's task computes other steps than the repetition")
        for _ in range(rounds):
            for name, work in competitors.items():
                taken[name].append(settled(work))
    possible, ours = ratio(taken["bare one"], taken["bare two"]), ratio(taken["one"], taken["two"])
    value = f"{median(taken['two']):.1f} s; on one {median(taken['one']):.1f} s"
    return [
        Row(
            "two bare processes of PyBullet, beside one", f"{ROLLOUTS} rollouts", possible, "one", "2 if cores are free"
        ),
        Row("one repetition of informative, two cores", value, ours, "one core", "≥ 1.7"),
    ]


if __name__ == "__main__":
    for row in rows(3):
        print(row.figure, row.value, row.ratio)
