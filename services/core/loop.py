"""The algorithm of the paper's Fig. 2: select a sample, measure it, tune simulators, transfer a controller, probe it.

A repetition is a generator of steps. Each step follows from the steps before it and from random streams with an
address, so the stored steps are the whole checkpoint: `repetition(setting, log)` continues after any log as if it had
never stopped.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator

from gaplab.services.core.answers import Answers
from gaplab.services.core.arrays import FloatArray, Genome, Parameters, no_readings
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.discrepancies.squared_fitness import SquaredFitness
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.held_out import split, tested
from gaplab.services.core.history import History
from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.ports import Reality, Sense, Simulate
from gaplab.services.core.search import maximise
from gaplab.services.core.space import Space
from gaplab.services.core.strategies.base import Score, Search, Strategy
from gaplab.services.core.streams import stream
from gaplab.services.core.tuners.base import Task, Tuner
from gaplab.services.core.tuners.search import Search as SearchTuner
from gaplab.services.core.tuning import Misfit, draw_simulators
from gaplab.services.core.types import (
    Belief,
    Budget,
    Cost,
    Measured,
    Probed,
    Sample,
    Selected,
    Step,
    Transferred,
    Tuned,
    learnable,
)


@dataclass(frozen=True, eq=False)
class Setting:
    """Everything that a repetition depends on.

    Attributes:
        simulate: fitness in simulation.
        reality: fitness in reality, evaluated once for each sample and each probe.
        strategy: selects the samples.
        optimizer: searches for controllers and simulators.
        genomes: the space of controllers.
        parameters: the space of simulators.
        known: `(g,)`, the hand-designed genome.
        budget: evaluations of each search.
        iterations: real-world evaluations to spend; 0 for the direct baseline.
        seed: seed of the experiment.
        repetition: number of the repetition, from 0.
        batch_size: returns how many rollouts a call of `simulate` should have at present; it changes no number.
        sense: simulation with readings; None if the robot has no sensors.
        reading_times_s: `(q,)`: time of each reading.
        discrepancy: what tuning minimises.
        tuner: finds simulators.
        held_out: share of the samples that no tuning sees.
    """

    simulate: Simulate
    reality: Reality
    strategy: Strategy
    optimizer: Optimizer
    genomes: Space
    parameters: Space
    known: Genome
    budget: Budget
    iterations: int
    seed: int
    repetition: int
    batch_size: Callable[[], int] = lambda: 1
    sense: Sense | None = None
    reading_times_s: FloatArray = field(default_factory=no_readings)
    discrepancy: Discrepancy = field(default_factory=SquaredFitness)
    tuner: Tuner = field(default_factory=SearchTuner)
    held_out: float = 0.0

    def stream(self, iteration: int, phase: str) -> Generator:
        """Return the random stream of one phase of one iteration."""
        return stream(self.seed, self.strategy.name, self.repetition, iteration, phase)

    def answers(self) -> Answers:
        """Return the answers of one step, which count and prefetch its rollouts."""
        return Answers(self.simulate, self.batch_size, sense=self.sense)


def repetition(
    setting: Setting, log: Iterable[Step] = (), answers: Callable[[], Answers] | None = None
) -> Iterator[Step]:
    """Yield the steps that follow the log, to the end of the repetition; each is computed when it is asked for.

    Args:
        setting: setting of the repetition.
        log: steps so far.
        answers: returns the answers of the next step; default: those of the setting.
    """
    history = History()
    for step in log:
        history = history.after(step)
    while (following := next_step(setting, history, (answers or setting.answers)())) is not None:
        yield following
        history = history.after(following)


def next_step(setting: Setting, history: History, answers: Answers) -> Step | None:  # noqa: PLR0911 - one a kind of step
    """Return the next step, whose rollouts come from `answers`; None at the end."""
    match history.last:
        case None:
            return _draw(setting)
        case Tuned(iteration=iteration):
            return _transfer(setting, history, iteration, answers)
        case Transferred(iteration=iteration, genome=genome):
            return _probe(setting, history, iteration, genome)
        case Probed(iteration=iteration) if iteration < setting.iterations:
            return _select(setting, history, iteration + 1, answers)
        case Selected(iteration=iteration, genome=genome):
            return Measured(iteration, Sample(genome, *setting.reality(genome)))
        case Measured(iteration=iteration):
            return _tune(setting, history, iteration, answers)
    return None


def _draw(setting: Setting) -> Tuned:
    """Return random simulators, because iteration 0 tunes nothing."""
    return Tuned(0, draw_simulators(setting.parameters, setting.strategy.ensemble, setting.stream(0, "tune")))


def _select(setting: Setting, history: History, iteration: int, answers: Answers) -> Selected:
    searched = setting.budget.selection_evaluations * setting.strategy.ensemble if setting.strategy.searches else 0
    if setting.budget.reuse_transfer and setting.strategy.selects_transferred and history.transferred is not None:
        return Selected(iteration, history.transferred, Cost(saved=searched))
    scale = history.scale or 1.0
    belief = Belief(
        setting.genomes, setting.known, history.samples, history.simulators, scale, discrepancy=setting.discrepancy
    )
    search = _search(setting, answers, belief.parameters, setting.stream(iteration, "search"))
    selected = setting.strategy.select(belief, search, setting.stream(iteration, "select"))
    genome = setting.genomes.check(selected, f"strategy {setting.strategy.name!r}")
    return Selected(iteration, genome, answers.cost_of(searched))


def _search(setting: Setting, answers: Answers, parameters: Parameters, rng: Generator) -> Search:
    """Return the one search that a selection has a budget for; strategies with `searches = False` get none."""
    name, left = setting.strategy.name, int(setting.strategy.searches)

    def search(score: Score) -> Genome:
        nonlocal left
        if not left:
            permitted = (
                "one search a selection is permitted" if setting.strategy.searches else "it has searches = False"
            )
            raise PluginBroken(f"strategy {name!r} has no budget left for this search: {permitted}")
        left -= 1
        found = maximise(
            setting.optimizer,
            setting.genomes,
            lambda asked: score(asked.genomes, answers(asked.genomes, parameters, asked.following)),
            setting.budget.selection_evaluations,
            rng,
        )
        best: Genome = found.genomes[0]
        return best

    return search


def _tune(setting: Setting, history: History, iteration: int, answers: Answers) -> Tuned:
    """Return simulators tuned on all samples whose measurement succeeded; random ones if there are none.

    Held-out samples are not tuned on: the best simulator is tested on them. The budget includes samples whose
    measurement failed; their rollouts count as saved.
    """
    ensemble, evaluations = setting.strategy.ensemble, setting.budget.simulator_evaluations
    seen, unseen = split(history.samples, setting.held_out)
    budget = evaluations * len(seen) + len(unseen)
    rng = setting.stream(iteration, "tune")
    samples, tests = learnable(seen), learnable(unseen)
    if not samples:
        return Tuned(iteration, draw_simulators(setting.parameters, ensemble, rng), Cost(saved=budget))
    optimizer = setting.optimizer.diverse(ensemble) if ensemble > 1 else setting.optimizer
    misfit = Misfit(answers, samples, setting.discrepancy, setting.reading_times_s)
    task = Task(misfit, setting.parameters, optimizer, ensemble, evaluations, history.simulators)
    found = setting.tuner.tune(task, rng)
    source = f"tuner {setting.tuner.name!r} with optimizer {setting.optimizer.name!r}"
    if not 1 <= len(found) <= ensemble:
        raise PluginBroken(f"{source} returned {len(found)} simulators; permitted: {ensemble}")
    for simulator in found:
        setting.parameters.check(simulator.parameters, source)
    if tests:
        found = tested(found, Misfit(answers, tests, setting.discrepancy, setting.reading_times_s))
    return Tuned(iteration, found, answers.cost_of(budget))


def _transfer(setting: Setting, history: History, iteration: int, answers: Answers) -> Transferred:
    """Return a controller evolved in the best simulator."""
    best = history.simulators[0].parameters[None, :]
    found = maximise(
        setting.optimizer,
        setting.genomes,
        lambda asked: answers(asked.genomes, best, asked.following)[:, 0],
        setting.budget.controller_evaluations,
        setting.stream(iteration, "transfer"),
    )
    fitness = float(found.fitness[0]) if np.isfinite(found.fitness[0]) else float("nan")
    cost = answers.cost_of(setting.budget.controller_evaluations)
    genome = setting.genomes.check(found.genomes[0], f"optimizer {setting.optimizer.name!r}")
    return Transferred(iteration, genome, fitness, cost)


def _probe(setting: Setting, history: History, iteration: int, genome: Genome) -> Probed:
    fitness, readings = setting.reality(genome)
    return Probed(iteration, fitness, recorded_fitness(fitness, history.samples), readings)


def recorded_fitness(probe: float, samples: Iterable[Sample]) -> float:
    """Return the larger fitness of the probe and the best sample; nan if every measurement failed.

    It can fall from one iteration to the next. Only its floor, the best sample so far, cannot.

    Source: paper, section 3.
    """
    measured = [value for value in (probe, *(each.fitness for each in samples)) if np.isfinite(value)]
    return max(measured, default=float("nan"))
