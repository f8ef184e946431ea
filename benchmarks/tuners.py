"""How far tuners end from the truth, and how often their intervals and posteriors contain it.

`python -m benchmarks.tuners` takes some minutes: the quadruped in MuJoCo, simulators in MuJoCo, random controllers as
samples, and a reality that is drawn from the bounds for each repetition.
"""

from argparse import ArgumentParser
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy import stats

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.answers import Answers
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.loop import Setting
from gaplab.services.core.streams import stream
from gaplab.services.core.tuners.base import TuningTask
from gaplab.services.core.tuning import Misfit
from gaplab.services.core.types import Sample, Simulator
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment

ENSEMBLE = 100
LEVELS = (0.5, 0.9, 0.95)


@dataclass(frozen=True)
class Method:
    """A discrepancy, a tuner, and the simulators that it may evaluate."""

    discrepancy: str
    tuner: str
    evaluations: int
    ensemble: int = 1

    def __str__(self) -> str:
        return f"{self.discrepancy}, {self.tuner}, {self.evaluations}"


METHODS = (
    Method("squared_fitness", "search", 200),
    Method("readings", "search", 200),
    Method("readings", "gauss_newton", 60),
    Method("readings", "abc_smc", 1_000, ENSEMBLE),
)


@dataclass(frozen=True)
class Trial:
    """One tuning.

    Attributes:
        away: `(p,)`: distance of the estimate from the truth, as a share of the bounds.
        inside: `(levels, p)`: whether the truth is in the region of each level; nan where the tuner states none.
        rollouts: that it took.
    """

    away: FloatArray
    inside: FloatArray
    rollouts: int


def made(method: Method, engine: str, truth: FloatArray | None = None) -> Setting:
    """Return a setting whose reality has the tunables `(p,)` that are given."""
    spec = {"strategy": "random", "engine": engine, "budget": "desk", "iterations": 1, "repetitions": 1}
    spec |= {"discrepancy": method.discrepancy, "tuner": method.tuner}
    if truth is not None:
        names = ("static_friction", "dynamic_friction", "restitution")
        spec["reality"] = {"parameters": dict(zip(names, truth.tolist(), strict=True))}
    return setting(resolve_experiment(ExperimentSpec.model_validate(spec)), 0)


def tunings(method: Method, engine: str, number: int, samples: int) -> Iterator[Trial]:
    """Yield the tunings of one repetition, on one sample more each."""
    space = made(method, engine).parameters
    truth = space.draw(1, stream(0, "truth", number))[0]
    one = made(method, engine, truth)
    rng, measured = stream(0, "samples", number), list[Sample]()
    previous = tuple(Simulator(row) for row in space.draw(method.ensemble, stream(0, "first", number)))
    optimizer = one.optimizer.diverse(method.ensemble) if method.ensemble > 1 else one.optimizer
    for count in range(1, samples + 1):
        while len(measured) < count:
            genome = one.genomes.draw(1, rng)[0]
            outcome = one.reality(genome)
            if np.isfinite(outcome.fitness):
                measured.append(Sample(genome, *outcome))
        answers = Answers(one.simulate, sense=one.sense)
        misfit = Misfit(answers, measured, one.discrepancy, one.reading_times_s)
        task = TuningTask(misfit, space, optimizer, method.ensemble, method.evaluations, previous)
        previous = one.tuner.tune(task, stream(0, "tune", number, count))
        away = np.abs(previous[0].parameters - truth) / space.extent
        yield Trial(away, _inside(previous, truth), answers.cost_of(0).rollouts)


def _inside(found: Sequence[Simulator], truth: FloatArray) -> FloatArray:
    """Return whether the truth is in the region of each level: of the ensemble, or in the stated interval."""
    inside = np.full((len(LEVELS), len(truth)), np.nan)
    if len(found) > 1:
        particles = np.array([each.parameters for each in found])
        for place, level in enumerate(LEVELS):
            lower, upper = np.quantile(particles, [(1 - level) / 2, (1 + level) / 2], axis=0)
            inside[place] = (lower <= truth) & (truth <= upper)
    elif found[0].interval is not None:
        inside[LEVELS.index(0.95)] = (found[0].interval[:, 0] <= truth) & (truth <= found[0].interval[:, 1])
    return inside


def _share(inside: FloatArray) -> str:
    """Return a share with its binomial 95 % interval."""
    if np.isnan(inside).any():
        return "-"
    told = stats.binomtest(int(inside.sum()), inside.size).proportion_ci(method="wilson")
    return f"{inside.mean():.2f} ({told.low:.2f}-{told.high:.2f})"


def main() -> None:
    """Tune, and print one table."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--engine", default="mujoco", help="engine of simulators and reality")
    parser.add_argument("--repetitions", type=int, default=24)
    parser.add_argument("--samples", type=int, default=3)
    arguments = parser.parse_args()
    table = Table(title=f"{arguments.repetitions} realities in {arguments.engine}, drawn from the bounds")
    tunables = ("static", "dynamic", "restitution")
    regions = tuple(f"truth in {level:.0%}" for level in LEVELS)
    for column in ("tuning", "samples", "rollouts", *(f"away: {name}" for name in tunables), "distance", *regions):
        table.add_column(column)
    for method in METHODS:
        by_count: dict[int, list[Trial]] = defaultdict(list)
        for number in range(arguments.repetitions):
            for count, tuning in enumerate(tunings(method, arguments.engine, number, arguments.samples), 1):
                by_count[count].append(tuning)
        for count, every in by_count.items():
            away = np.array([each.away for each in every])
            inside = np.array([each.inside for each in every])
            distance = np.median(np.linalg.norm(away, axis=1))
            table.add_row(
                str(method),
                str(count),
                f"{np.mean([each.rollouts for each in every]):.0f}",
                *(f"{value:.3f}" for value in np.median(away, axis=0)),
                f"{distance:.3f}",
                *(_share(inside[:, place].ravel()) for place in range(len(LEVELS))),
            )
    Console(width=180).print(table)


if __name__ == "__main__":
    main()
