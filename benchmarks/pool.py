"""Speed-up of one repetition of *informative* on two cores, beside that of two bare processes on this machine.

`python -m benchmarks.pool --evaluations 1000` prints it, and that of each kind of step; `--preset lean` takes the
optimizer and options of that budget.
"""

import argparse
from collections import Counter
from collections.abc import Callable, Iterable
from statistics import median
from time import perf_counter, sleep
from typing import Any, TypeAlias

import ray

from benchmarks.measure import Row, ratio
from benchmarks.physics import SWITCHING, genomes, simulation
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Selected, Step, Transferred, Tuned
from gaplab.services.running.execution import Claim, TimedStep
from gaplab.services.settings import Settings
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.presets import PRESETS
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.workers import task
from gaplab.workers.checkpoints import CHECKPOINT_S
from gaplab.workers.cluster import cluster

EVALUATIONS = 160
"""Evaluations of a transfer; a selection has as many, of 20 rollouts each, and a tuning a quarter."""

ROLLOUTS = 120
SETTLE_S = 1.0


Spent: TypeAlias = list[tuple[str, int, float]]
"""Kind, rollouts and seconds of each step."""


def spec_of(evaluations: int = EVALUATIONS, preset: str = "paper") -> ExperimentSpec:
    """Return a spec whose selection has nine tenths of the rollouts, 20 a newcomer, as at the paper's budgets."""
    budget = {
        "preset": preset,
        "controller_evaluations": evaluations,
        "selection_evaluations": evaluations,
        "simulator_evaluations": evaluations // 4,
    }
    return ExperimentSpec.model_validate(
        {"strategy": "informative", "iterations": 1, "repetitions": 1, "budget": budget}
    )


def _spent(steps: Iterable[tuple[Step, float]]) -> Spent:
    return [
        (type(step).__name__.lower(), step.cost.rollouts, seconds)
        for step, seconds in steps
        if isinstance(step, Selected | Tuned | Transferred)
    ]


@ray.remote(num_cpus=1)
def _alone(spec: ExperimentSpec) -> Spent:
    """Run the repetition on one core, even if others are idle."""

    def timed() -> Iterable[tuple[Step, float]]:
        begun = perf_counter()
        for step in repetition(setting(resolve_experiment(spec), 0)):
            yield step, perf_counter() - begun
            begun = perf_counter()

    return _spent(timed())


@ray.remote(num_cpus=1)
def _rollouts(count: int) -> int:
    """Run rollouts in one process."""
    simulate, drawn = simulation(), genomes()
    for index in range(count):
        simulate(drawn[[index % len(drawn)]], SWITCHING)
    return count


def alone(spec: ExperimentSpec) -> Spent:
    """Run the repetition in one process; return what its steps took."""
    found: Spent = ray.get(_alone.remote(spec))
    return found


def on_all_cores(spec: ExperimentSpec) -> Spent:
    """Run the repetition as the service does; return what its steps took."""
    claim = Claim(id=0, epoch=0, experiment_id="none", number=0, spec=resolve_experiment(spec))
    stream: Any = task.run.remote(claim, {}, CHECKPOINT_S, None)
    delivered = (each for batch in stream for each in ray.get(batch))
    return _spent((each.step, each.seconds) for each in delivered if isinstance(each, TimedStep))


def bare(processes: int) -> Callable[[], int]:
    """Return work: rollouts divided among independent processes."""
    return lambda: sum(ray.get([_rollouts.remote(ROLLOUTS // processes) for _ in range(processes)]))


def settled(work: Callable[[], object]) -> float:
    """Return the duration of work in seconds, after Ray has noticed that the cores are idle."""
    sleep(SETTLE_S)
    begun = perf_counter()
    work()
    return perf_counter() - begun


def rows(rounds: int, spec: ExperimentSpec | None = None) -> list[Row]:
    """Measure the speed-up of a repetition, of each kind of its steps, and of bare processes in the same rounds."""
    spec = spec or spec_of()
    spent: dict[str, list[Spent]] = {"one": [], "two": []}
    competitors: dict[str, Callable[[], object]] = {
        "one": lambda: spent["one"].append(alone(spec)),
        "two": lambda: spent["two"].append(on_all_cores(spec)),
        "bare one": bare(1),
        "bare two": bare(2),
    }
    taken: dict[str, list[float]] = {name: [] for name in competitors}
    with cluster(Settings(workers=2)):
        bare(2)()  # load the engines
        first = spec_of(preset=spec.budget.preset)
        if _rollouts_of(on_all_cores(first)) != _rollouts_of(alone(first)):
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
        *_step_rows(spent["one"], spent["two"]),
    ]


def _step_rows(one: list[Spent], two: list[Spent]) -> list[Row]:
    found = []
    for kind, rollouts in _rollouts_of(one[0]).items():
        ours, theirs = ([_seconds(each, kind) for each in runs] for runs in (two, one))
        value = f"{rollouts:,} rollouts: {median(ours):.1f} s; on one {median(theirs):.1f} s"
        found.append(Row(f"of that, {kind}", value, ratio(theirs, ours), "one core"))
    return found


def _rollouts_of(spent: Spent) -> Counter[str]:
    counts: Counter[str] = Counter()
    for kind, rollouts, _ in spent:
        counts[kind] += rollouts
    return counts


def _seconds(spent: Spent, kind: str) -> float:
    return sum(seconds for name, _, seconds in spent if name == kind)


def main() -> None:
    """Print the rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--evaluations", type=int, default=EVALUATIONS, help="evaluations of a transfer")
    parser.add_argument("--preset", default="paper", choices=list(PRESETS), help="what the numbers leave out")
    parser.add_argument("--rounds", type=int, default=3, help="rounds in which the parts of a ratio take turns")
    arguments = parser.parse_args()
    for row in rows(arguments.rounds, spec_of(arguments.evaluations, arguments.preset)):
        print(f"{row.figure}: {row.value}", "" if row.ratio is None else f"{row.ratio:.2f}", sep="; ")


if __name__ == "__main__":
    main()
