"""How many rollouts each optimizer needs to reach what the paper's evolution reaches with the paper's budgets.

`python -m benchmarks.optimizers` takes some minutes: it searches for controllers with 10 000 evaluations, and for
simulators, on five samples, with 2 000, on the toy function and on the quadruped in MuJoCo.
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
from gaplab.services.core.streams import stream
from gaplab.services.core.tuning import Misfit
from gaplab.services.core.types import Sample, Space
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_experiment

CONTROLLERS = 10_000
SIMULATORS = 2_000
SAMPLES = 5
SEARCHES = 10
PAPERS = "steady_state"
COLUMNS = ("robot", "search for", "optimizer", "rollouts", "best fitness", "reach the paper's", "rollouts until")
ROBOTS = {"toy_function": "analytic", "quadruped": "mujoco"}


@dataclass(frozen=True)
class Problem:
    """Something to maximise.

    Attributes:
        space: of what is searched for.
        evaluate: the fitness, as an optimizer asks for it.
        rollouts: that were simulated so far.
        evaluations: the paper's budget.
    """

    space: Space
    evaluate: Evaluate
    rollouts: Callable[[], int]
    evaluations: int


@dataclass(frozen=True)
class Trace:
    """The best fitness after so many rollouts, whenever either has changed."""

    rollouts: tuple[int, ...]
    best: tuple[float, ...]

    def until(self, fitness: float) -> float:
        """Rollouts until it was reached; infinite if it never was."""
        return next(
            (float(rollouts) for rollouts, best in zip(self.rollouts, self.best, strict=True) if best >= fitness),
            float("inf"),
        )


def controllers(one: Setting, seed: int) -> Problem:
    """Controllers, in a simulator drawn at random."""
    answers = Answers(one.simulate)
    simulator = one.parameters.draw(1, stream(seed, "simulator"))
    return Problem(
        one.genomes,
        lambda asked: answers(asked.genomes, simulator)[:, 0],
        lambda: answers.cost_of(0).rollouts,
        CONTROLLERS,
    )


def simulators(one: Setting, seed: int) -> Problem:
    """Simulators, on what reality says of controllers drawn at random."""
    drawn = one.genomes.draw(SAMPLES, stream(seed, "samples"))
    answers = Answers(one.simulate)
    misfit = Misfit(answers, [Sample(genome, one.reality(genome)) for genome in drawn])
    return Problem(one.parameters, misfit, lambda: answers.cost_of(0).rollouts, SIMULATORS)


PROBLEMS = {"controllers": controllers, "simulators": simulators}


def traced(problem: Problem, optimizer: Optimizer, seed: int) -> Trace:
    """One search."""
    rollouts: list[int] = []
    best: list[float] = []

    def evaluate(asked: Question) -> FloatArray:
        fitness = problem.evaluate(asked)
        rollouts.append(problem.rollouts())
        best.append(max(float(np.nanmax(fitness, initial=-np.inf)), best[-1] if best else -np.inf))
        return fitness

    maximise(optimizer, problem.space, evaluate, problem.evaluations, stream(seed, "search"))
    return Trace(tuple(rollouts), tuple(best))


def compared(robot: str, kind: str, searches: int) -> Iterator[tuple[str, ...]]:
    """A row of the table for each optimizer."""
    spec = resolve_experiment(
        ExperimentSpec(
            strategy=PluginRef(name="random"), robot=PluginRef(name=robot), engine=PluginRef(name=ROBOTS[robot])
        )
    )
    one = setting(spec, 0)
    traces = {
        name: [traced(PROBLEMS[kind](one, seed), each(), seed) for seed in range(searches)]
        for name, each in optimizers.items()
    }
    for name, found in traces.items():
        needed = [trace.until(papers.best[-1]) for trace, papers in zip(found, traces[PAPERS], strict=True)]
        reached = sum(np.isfinite(needed))
        yield (
            robot,
            kind,
            name,
            f"{median(trace.rollouts[-1] for trace in found):,.0f}",
            f"{median(trace.best[-1] for trace in found):.4g}",
            f"{reached} of {searches}",
            f"{median(needed):,.0f}" if np.isfinite(median(needed)) else "more",
        )


def main() -> None:
    """Search, and print the table."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--searches", type=int, default=SEARCHES, help="of each kind with each optimizer")
    searches = parser.parse_args().searches
    table = Table(title=f"medians of {searches} searches")
    for column in (
        "robot",
        "search for",
        "optimizer",
        "rollouts",
        "best fitness",
        "reach the paper's",
        "rollouts until",
    ):
        table.add_column(column)
    for robot in ROBOTS:
        for kind in PROBLEMS:
            for row in compared(robot, kind, searches):
                table.add_row(*row)
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
