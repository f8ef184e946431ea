"""`python -m benchmarks.scale`: duration of the paper's Fig. 4 by number of cores, from measured speeds of engines.

Only physics is counted. Let W be the work of a computation in core-seconds, and S the seconds of its longest chain of
dependent steps. On P cores it takes at least max(W / P, S), and at most W / P + S if no core idles while there is work
(Brent 1974). The longest chain is a repetition of *informative*: one newcomer after another, where
`gaplab.workers.lending` distributes the rollouts of one newcomer.
"""

from collections.abc import Iterator
from math import ceil
from statistics import median
from time import process_time
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.engines import ROBOT, TUNED, genomes, simulation
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.core.arrays import Parameters
from gaplab.services.core.strategies import strategies
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.specs.resolution import resolve
from gaplab.services.world.tunables import tunables
from gaplab.workers.lending import LEAST_S

CORES = (2, 16, 64, 1_000)
FIGURE_4 = StudySpec(direct_repetitions=100)
LEND_S = 0.001  # to send work to another core and receive the result; measured: 0.4 to 1 ms
TURNS, MANY = 12, 20


class Speed(NamedTuple):
    """Core-seconds of one rollout: in a separate call, and in a call with many."""

    alone_s: float
    together_s: float


class Calls(NamedTuple):
    """A phase of a repetition: a number of calls of `Simulate`, each of which waits for the one before."""

    number: int
    rollouts: int

    def work_s(self, speed: Speed) -> float:
        """Return the work in core-seconds."""
        return self.number * self.rollouts * (speed.alone_s if self.rollouts == 1 else speed.together_s)

    def chain_s(self, speed: Speed) -> float:
        """Return the duration in seconds with as many cores as are useful."""
        parts = max(1, min(self.rollouts, int(self.rollouts * speed.together_s / LEAST_S)))
        together = ceil(self.rollouts / parts)
        each_s = speed.alone_s if together == 1 else speed.together_s
        return self.number * (together * each_s + (LEND_S if parts > 1 else 0.0))


def phases(spec: ExperimentSpec) -> Iterator[Calls]:
    """Yield the phases of one repetition of a resolved spec, as budgeted, without savings."""
    strategy, iterations = strategies.create(spec.strategy), spec.iterations or 0
    if not strategy.takes_samples:
        yield Calls(spec.budget.controller_evaluations or 0, strategy.transfer_simulators(len(spec.tunables)))
        return
    yield Calls((iterations + 1) * (spec.budget.controller_evaluations or 0), 1)
    if strategy.searches:
        simulators = strategy.selection_simulators(len(spec.tunables), learned=False)
        yield Calls(iterations * (spec.budget.selection_evaluations or 0), simulators)
    for samples in range(1, iterations + 1):
        yield Calls(spec.budget.simulator_evaluations or 0, samples)


def figure() -> Iterator[tuple[int, tuple[Calls, ...]]]:
    """Yield repetitions and phases of each experiment of the paper's Fig. 4, including the direct baseline."""
    for spec in resolve(FIGURE_4):
        yield spec.repetitions or 0, tuple(phases(spec))


def measured(engine: type[Engine]) -> Speed:
    """Measure the speed of an engine with the kinds of genomes and simulators that occur in searches."""
    simulate = simulation(engine())
    ranges = [[tunables[name].lower or 0.0, tunables[name].upper or 1.0] for name in TUNED]
    lower, upper = np.transpose(ranges)
    drawn = np.random.default_rng(0).uniform(lower, upper, (MANY, len(TUNED)))
    drawn_genomes = genomes(TURNS + 1)
    simulate(drawn_genomes, drawn)  # loads the engine

    def seconds(simulators: Parameters) -> float:
        taken = []
        for genome in drawn_genomes:
            begun = process_time()
            simulate(genome[None], simulators)
            taken.append((process_time() - begun) / len(simulators))
        return median(taken)

    return Speed(alone_s=seconds(drawn[:1]), together_s=seconds(drawn))


def main() -> None:
    """Measure the installed engines, and print the table."""
    console = Console(width=140)
    total = sum(repetitions * each.number * each.rollouts for repetitions, calls in figure() for each in calls)
    table = Table(title=f"the paper's Fig. 4: {total / 1e6:.1f} million rollouts")
    cores = (f"{cores:,} cores" for cores in CORES)
    for column in ("engine", "rollout alone", f"in a batch of {MANY}", *cores, "longest chain"):
        table.add_column(column, justify="left" if column == "engine" else "right")
    for engine in engines.values():
        if engine.runs(ROBOT.world) and engine.available():
            speed = measured(engine)
            rollout = (f"{1e3 * speed.alone_s:.1f} ms", f"{1e3 * speed.together_s:.1f} ms")
            table.add_row(engine.name, *rollout, *_durations(speed))
    console.print(table)


def _durations(speed: Speed) -> Iterator[str]:
    """Yield lower and upper bound for each number of cores, and the longest chain."""
    work = sum(repetitions * each.work_s(speed) for repetitions, calls in figure() for each in calls)
    chain = max(sum(each.chain_s(speed) for each in calls) for _, calls in figure())
    for cores in CORES:
        least, most = _shown(max(work / cores, chain)), _shown(work / cores + chain)
        yield least if least == most else f"{least} – {most}"
    yield _shown(chain)


def _shown(seconds: float) -> str:
    hours = seconds / 3600
    return f"{hours / 24:.1f} d" if hours >= 24 else f"{hours:.0f} h" if hours >= 10 else f"{hours:.1f} h"


if __name__ == "__main__":
    main()
