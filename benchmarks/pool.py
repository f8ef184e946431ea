"""One repetition of *informative* on two cores against one, and what two bare processes gain on this machine."""

from collections.abc import Callable
from statistics import median
from time import perf_counter, sleep

import ray

from benchmarks.measure import Row, ratio
from benchmarks.physics import SWITCHING, genomes, simulation
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.loop import repetition
from gaplab.services.running.execution import Claim, TimedStep
from gaplab.services.settings import Settings
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.workers import repetitions as task
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
"""Nine tenths of its rollouts are the selection's, 20 for each newcomer, as at the paper's budgets."""

ROLLOUTS = 120
SETTLE_S = 1.0


@ray.remote(num_cpus=1)
def _alone() -> int:
    """The repetition on one core, whatever else is idle."""
    return sum(1 for _ in repetition(setting(resolve_experiment(SPEC), 0)))


@ray.remote(num_cpus=1)
def _rollouts(count: int) -> int:
    """Rollouts of one process."""
    simulate, drawn = simulation(), genomes()
    for index in range(count):
        simulate(drawn[[index % len(drawn)]], SWITCHING)
    return count


def alone() -> int:
    """The steps of the repetition, in one process."""
    return int(ray.get(_alone.remote()))


def spread() -> int:
    """The steps of the repetition, as the service runs it."""
    claim = Claim(id=0, epoch=0, experiment_id="none", number=0, spec=resolve_experiment(SPEC))
    stream = task.run.remote(claim, {}, CHECKPOINT_S)
    return sum(isinstance(each, TimedStep) for batch in stream for each in ray.get(batch))


def bare(processes: int) -> Callable[[], int]:
    """Rollouts shared by processes that need nothing of each other."""
    return lambda: sum(ray.get([_rollouts.remote(ROLLOUTS // processes) for _ in range(processes)]))


def settled(work: Callable[[], int]) -> float:
    """The seconds that the work takes, once Ray knows that the cores of what was before are idle."""
    sleep(SETTLE_S)
    begun = perf_counter()
    work()
    return perf_counter() - begun


def rows(rounds: int) -> list[Row]:
    """The speed-up of a repetition beside that of bare processes, in the same turns."""
    rivals = {"one": alone, "two": spread, "bare one": bare(1), "bare two": bare(2)}
    taken: dict[str, list[float]] = {name: [] for name in rivals}
    with cluster(Settings(workers=2)):
        bare(2)()  # loads engines
        if spread() != alone():
            msg = "the service's task computes other steps than the repetition"
            raise RuntimeError(msg)
        for _ in range(rounds):
            for name, work in rivals.items():
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
