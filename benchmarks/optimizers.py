"""Rollouts that each optimizer needs to reach the fitness of the paper's evolution at the paper's budgets.

`python -m benchmarks.optimizers` takes some minutes. It searches for controllers with 10 000 evaluations, and for
simulators on five samples with 2 000, on the toy function and on the quadruped in MuJoCo.
"""

from argparse import ArgumentParser
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from statistics import median

import numpy as np
from rich.console import Console
from rich.table import Table

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.answers import Answers
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.loop import Setting
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.search import Evaluate, Question, maximise
from gaplab.services.core.space import Space
from gaplab.services.core.streams import stream
from gaplab.services.core.tuning import Misfit
from gaplab.services.core.types import Sample
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment

CONTROLLERS = 10_000
SIMULATORS = 2_000
SAMPLES = 5
SEARCHES = 10
PAPERS = "steady_state"
COLUMNS = ("robot", "search for", "optimizer", "rollouts", "best fitness", "reach the paper's", "rollouts until then")
ROBOTS = {"toy_function": "analytic", "quadruped": "mujoco"}


@dataclass(frozen=True)
class SearchProblem:
    """A fitness to maximise.

    Attributes:
        space: search space.
        evaluate: function from genomes and bounds to fitness.
        rollouts: function that returns the number of rollouts so far.
        evaluations: the paper's budget.
    """

    space: Space
    evaluate: Evaluate
    rollouts: Callable[[], int]
    evaluations: int


@dataclass(frozen=True)
class BestSoFar:
    """The best fitness by number of rollouts, after each call."""

    rollouts: tuple[int, ...]
    best: tuple[float, ...]

    def until(self, fitness: float) -> float:
        """Return the number of rollouts until a fitness is reached; infinity if it never is."""
        return next(
            (float(rollouts) for rollouts, best in zip(self.rollouts, self.best, strict=True) if best >= fitness),
            float("inf"),
        )


def controllers(one: Setting, seed: int) -> SearchProblem:
    """Return the search for controllers in a random simulator."""
    answers = Answers(one.simulate)
    simulator = one.parameters.draw(1, stream(seed, "simulator"))
    return SearchProblem(
        one.genomes,
        lambda asked: answers(asked.genomes, simulator)[:, 0],
        lambda: answers.cost_of(0).rollouts,
        CONTROLLERS,
    )


def simulators(one: Setting, seed: int) -> SearchProblem:
    """Return the search for simulators on samples of random controllers."""
    drawn = one.genomes.draw(SAMPLES, stream(seed, "samples"))
    answers = Answers(one.simulate)
    misfit = Misfit(answers, [Sample(genome, *one.reality(genome)) for genome in drawn])
    return SearchProblem(one.parameters, misfit, lambda: answers.cost_of(0).rollouts, SIMULATORS)


PROBLEMS = {"controllers": controllers, "simulators": simulators}


def searched(problem: SearchProblem, optimizer: Optimizer, seed: int) -> BestSoFar:
    """Run one search."""
    rollouts: list[int] = []
    best: list[float] = []

    def evaluate(asked: Question) -> FloatArray:
        fitness = problem.evaluate(asked)
        rollouts.append(problem.rollouts())
        best.append(max(float(np.nanmax(fitness, initial=-np.inf)), best[-1] if best else -np.inf))
        return fitness

    maximise(optimizer, problem.space, evaluate, problem.evaluations, stream(seed, "search"))
    return BestSoFar(tuple(rollouts), tuple(best))


def compared(robot: str, kind: str, searches: int) -> Iterator[tuple[str, ...]]:
    """Yield a row of the table for each optimizer."""
    spec = resolve_experiment(
        ExperimentSpec(
            strategy=PluginRef(name="random"), robot=PluginRef(name=robot), engine=PluginRef(name=ROBOTS[robot])
        )
    )
    one = setting(spec, 0)
    results = {
        name: [searched(PROBLEMS[kind](one, seed), optimizer(), seed) for seed in range(searches)]
        for name, optimizer in optimizers.items()
    }
    for name, found in results.items():
        needed = [search.until(papers.best[-1]) for search, papers in zip(found, results[PAPERS], strict=True)]
        reached = sum(np.isfinite(needed))
        yield (
            robot,
            kind,
            name,
            f"{median(search.rollouts[-1] for search in found):,.0f}",
            f"{median(search.best[-1] for search in found):.4g}",
            f"{reached} of {searches}",
            f"{median(needed):,.0f}" if np.isfinite(median(needed)) else "more",
        )


def main() -> None:
    """Run all searches, and print the table."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--searches", type=int, default=SEARCHES, help="searches of each kind with each optimizer")
    searches = parser.parse_args().searches
    table = Table(title=f"medians of {searches} searches")
    for column in COLUMNS:
        table.add_column(column)
    for robot in ROBOTS:
        for kind in PROBLEMS:
            for row in compared(robot, kind, searches):
                table.add_row(*row)
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
