"""The algorithm of the paper's Fig. 2: select a sample, measure it, tune simulators, transfer a controller, probe it.

A repetition is a generator of steps. Each step follows from the steps before it and from random streams with an
address, so the stored steps are the whole checkpoint: `repetition(setting, log)` continues after any log as if it had
never stopped.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import reduce
from math import nan
from typing import Literal

from numpy.random import Generator

from gaplab.services.core.answers import Answers
from gaplab.services.core.arrays import NO_GENOMES, FloatArray, Genome, Genomes, frozen, no_readings
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.discrepancies.fitness import SquaredFitness
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.linear_models import fitted
from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.ports import Forecast, Reality, Sense, Simulate
from gaplab.services.core.search import Allowance, ControllerSearch
from gaplab.services.core.space import Space
from gaplab.services.core.strategies.base import Strategy
from gaplab.services.core.streams import stream
from gaplab.services.core.tuners.base import Tuner, TuningTask
from gaplab.services.core.tuners.search import SearchTuner
from gaplab.services.core.tuning import Misfit, sound, split, tested
from gaplab.services.core.types import (
    Belief,
    Budget,
    Cost,
    History,
    Measured,
    Outcome,
    Probed,
    Sample,
    Selected,
    Simulator,
    Step,
    Transferred,
    Tuned,
    learnable,
    probe_of,
)

NOTHING: Genome = frozen([])
"""What is transferred where reality was recorded."""


@dataclass(frozen=True, eq=False)
class Setting:
    """Everything that a repetition depends on.

    Attributes:
        simulate: fitness in simulation.
        reality: fitness in reality, evaluated once for each sample and each probe.
        strategy: selects the samples.
        optimizer: searches for simulators, and for controllers if `controller_optimizer` is None.
        genomes: the space of controllers.
        parameters: the space of simulators.
        known: `(g,)`, the hand-designed genome.
        budget: evaluations of each search.
        iterations: real-world evaluations to spend; 0 for a strategy without samples.
        seed: seed of the experiment.
        repetition: number of the repetition, from 0.
        batch_size: returns how many rollouts a call of `simulate` should have at present; it changes no number.
        sense: simulation with readings; None if the robot has no sensors.
        reading_times_s, reading_periods: `(q,)`: time of each reading, and its period over its noise; 0 for none.
        discrepancy: what tuning minimises.
        tuner: finds simulators.
        held_out: share of the samples that no tuning sees.
        names: `(p,)`: names of the tunables.
        probes: iterations whose transferred controller is measured in reality.
        known_samples: samples from before, on which the first simulators are tuned.
        forecast: safety forecast of a controller for a physical robot; None if there is none.
        controller_optimizer: searches for controllers.
        candidates: `(n, g)`: the recordings of a recorded reality, each of which may be selected once; then nothing is
            transferred or probed, and the error on `tests` is recorded. None: any genome may be selected.
        tests: samples that no tuning sees, known beforehand.
        untuned: discrepancy of the robot as it is from `tests`.
        commands: `(n, c)`: what was commanded in each recording; None if nothing was.
        noise: standard deviation of the noise of a measured fitness, as a share of `Belief.scale`; 0: no noise. With
            noise, each reading has its sensor's too.
        noise_unit: the same in the unit of fitness, in place of `noise`; 0: `noise` counts.
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
    reading_periods: FloatArray = field(default_factory=no_readings)
    discrepancy: Discrepancy = field(default_factory=SquaredFitness)
    tuner: Tuner = field(default_factory=SearchTuner)
    held_out: float = 0.0
    names: tuple[str, ...] = ()
    probes: Literal["each", "last", "never"] = "each"
    known_samples: tuple[Sample, ...] = ()
    forecast: Forecast | None = None
    controller_optimizer: Optimizer | None = None
    candidates: Genomes | None = None
    tests: tuple[Sample, ...] = ()
    untuned: Callable[[], float] = lambda: nan
    commands: FloatArray | None = None
    noise: float = 0.0
    noise_unit: float = 0.0

    @property
    def tunes_first(self) -> bool:
        """Whether the first simulators are tuned, or at least tested, on samples that are known beforehand."""
        return self.candidates is not None or bool(self.known_samples and self.strategy.takes_samples)

    def stream(self, iteration: int, phase: str) -> Generator:
        """Return the random stream of one phase of one iteration."""
        return stream(self.seed, self.strategy.name, self.repetition, iteration, phase)

    def history(self, log: Iterable[Step] = ()) -> History:
        """Return the result of these steps, which follow the samples from before the experiment."""
        return reduce(History.after, log, History(samples=self.known_samples))

    def answers(self) -> Answers:
        """Return the answers of one step, which count and prefetch its rollouts."""
        return Answers(self.simulate, self.batch_size, sense=self.sense, periods=self.reading_periods)


def repetition(
    setting: Setting, log: Iterable[Step] = (), answers: Callable[[], Answers] | None = None
) -> Iterator[Step]:
    """Yield the steps that follow the log, to the end of the repetition; each is computed when it is asked for.

    Args:
        setting: setting of the repetition.
        log: steps so far.
        answers: returns the simulators' answers for the next step, which count its rollouts; default:
            `setting.answers`.

    Raises:
        RealityAwaited: reality is physical; the repetition goes on after a log with the answer.
    """
    history = setting.history(log)
    while (following := next_step(setting, history, (answers or setting.answers)())) is not None:
        yield following
        history = history.after(following)


def next_step(setting: Setting, history: History, answers: Answers) -> Step | None:  # noqa: PLR0911 - one a kind of step
    """Return the next step, whose rollouts come from `answers`; None at the end."""
    match history.last:
        case None if setting.tunes_first:
            return _tune(setting, history, 0, answers)
        case None:
            return Tuned(0, _drawn(setting, 0))
        case Tuned(iteration=iteration):
            return _transfer(setting, history, iteration, answers)
        case Transferred(iteration=iteration, genome=genome):
            return _probe(setting, history, iteration, genome)
        case Probed(iteration=iteration) if iteration < setting.iterations:
            return _select(setting, history, iteration + 1, answers)
        case Selected(iteration=iteration, genome=genome):
            return Measured(iteration, Sample(genome, *_measure(setting, history, iteration, "sample", genome)))
        case Measured(iteration=iteration):
            return _tune(setting, history, iteration, answers)
    return None


def _drawn(setting: Setting, iteration: int) -> tuple[Simulator, ...]:
    """Return simulators before the first sample, which are random. Source: paper, section 2."""
    strategy, space, source = setting.strategy, setting.parameters, f"strategy {setting.strategy.name!r}"
    drawn = strategy.draw(space, setting.names, setting.stream(iteration, "tune"))
    if len(drawn) != strategy.ensemble:
        raise PluginBroken(f"{source} drew {len(drawn)} simulators; permitted: {strategy.ensemble}, its ensemble")
    return tuple(Simulator(space.check(parameters, source)) for parameters in drawn)


def _keeps(setting: Setting, history: History, kind: type[Step]) -> bool:
    """Return whether the latest result of a kind of step stays, since the strategy learns nothing from what is new.

    A transfer that asks no simulator is made anew after each sample.
    """
    if kind is not Tuned and not setting.strategy.transfer_simulators(setting.parameters.size):
        return False
    newest = history.samples[history.seen.get(kind, len(history.samples)) :]
    lessons = setting.strategy.lessons(history.samples) if newest else ()
    return bool(newest) and not any(each is sample for each in lessons for sample in newest)


def belief_of(setting: Setting, history: History) -> Belief:
    """Return what the strategy may know after a history."""
    return Belief(
        space=setting.genomes,
        known=setting.known,
        samples=history.samples,
        simulators=history.simulators,
        tunables=setting.parameters,
        names=setting.names,
        scale=history.scale or 1.0,
        discrepancy=setting.discrepancy,
        candidates=_left(setting, history),
        commands=setting.commands,
        members=history.members,
        reading_times_s=setting.reading_times_s,
        reading_periods=setting.reading_periods,
    )


def _left(setting: Setting, history: History) -> Genomes | None:
    """Return the candidates `(n, g)` that are not among the samples; None if any genome may be selected."""
    if setting.candidates is None:
        return None
    used = {sample.genome.tobytes() for sample in history.samples}
    return setting.candidates[[genome.tobytes() not in used for genome in setting.candidates]]


def _search(setting: Setting, belief: Belief, answers: Answers, given: Allowance, rng: Generator) -> ControllerSearch:
    optimizer, answers.budget = setting.controller_optimizer or setting.optimizer, given.rollouts
    return ControllerSearch(setting.strategy.name, optimizer, belief, answers, given, rng)


def _kept(strategy: Strategy, search: ControllerSearch) -> Genomes:
    """Return what a strategy that continues goes on from, `(n, g)`: none if its optimizer has not searched."""
    return frozen(search.members) if strategy.continues else NO_GENOMES


def _select(setting: Setting, history: History, iteration: int, answers: Answers) -> Selected:
    """Return the controller that the strategy selects, from a search if it has one."""
    budget, strategy, learned = setting.budget, setting.strategy, bool(learnable(history.samples))
    belief = belief_of(setting, history)
    evaluations = belief.at_most(budget.selection_evaluations)
    allowance = Allowance.of_selection(strategy, evaluations, setting.parameters.size, learned=learned)
    if budget.reuse_transfer and strategy.selects_transferred and history.transferred is not None:
        return Selected(iteration, history.transferred.genome, Cost(saved=allowance.rollouts))
    search = _search(setting, belief, answers, allowance, setting.stream(iteration, "search"))
    selected = strategy.select(belief, search, setting.stream(iteration, "select"))
    genome = setting.genomes.check(selected, f"strategy {strategy.name!r}")
    if belief.candidates is not None and not (belief.candidates == genome).all(axis=1).any():
        raise PluginBroken(f"strategy {strategy.name!r} selected {genome}; permitted: a candidate that is left")
    return Selected(iteration, genome, answers.cost, members=_kept(strategy, search))


def _tune(setting: Setting, history: History, iteration: int, answers: Answers) -> Tuned:
    """Return simulators tuned on the strategy's lessons whose measurement succeeded; random ones if there are none.

    The best simulator is tested on samples that are held out. The budget includes samples that are not lessons or whose
    measurement failed; their rollouts count as saved. The simulators of a strategy that does not tune stay.
    """
    strategy = setting.strategy
    if not strategy.tunes:
        return Tuned(iteration, history.simulators or _drawn(setting, iteration))
    seen, unseen = split(history.samples, setting.held_out)
    evaluations = setting.budget.simulator_evaluations // setting.tuner.divisor(len(seen))
    unseen = (*unseen, *setting.tests)
    ensemble, answers.budget = strategy.ensemble, evaluations * len(seen) + len(unseen)
    if _keeps(setting, history, Tuned):
        return Tuned(iteration, history.simulators, answers.cost)
    lessons = [each for each in strategy.lessons(history.samples) if any(each is sample for sample in seen)]
    samples, tests = learnable(lessons), learnable(unseen)
    untested = tests and Misfit(answers, tests, setting.discrepancy, setting.reading_times_s)
    if not samples:
        drawn = _drawn(setting, iteration)
        return Tuned(iteration, tested(drawn, untested) if untested else drawn, answers.cost)
    optimizer = setting.optimizer.diverse(ensemble) if ensemble > 1 else setting.optimizer
    misfit = Misfit(answers, samples, setting.discrepancy, setting.reading_times_s)
    task = TuningTask(misfit, setting.parameters, optimizer, ensemble, evaluations, history.simulators)
    found = setting.tuner.tune(task, setting.stream(iteration, "tune"))
    source = f"tuner {setting.tuner.name!r} with optimizer {setting.optimizer.name!r}"
    if not 1 <= len(found) <= ensemble:
        raise PluginBroken(f"{source} returned {len(found)} simulators; permitted: {ensemble}")
    found = tuple(sound(simulator, setting.parameters, source) for simulator in found)
    if untested:
        found = tested(found, untested)
    cost = answers.cost_within_budget(source)  # without those of the next line
    return Tuned(iteration, fitted(found, misfit, setting.parameters, setting.stream(iteration, "fit")), cost)


def _transfer(setting: Setting, history: History, iteration: int, answers: Answers) -> Transferred:
    """Return the controller that the strategy transfers, from a search if it has one; nothing of recordings."""
    if setting.candidates is not None:
        return Transferred(iteration, NOTHING, nan)
    strategy, evaluations = setting.strategy, setting.budget.controller_evaluations
    allowance = Allowance.of_transfer(strategy, evaluations, setting.parameters.size)
    if (last := history.transferred) is not None and _keeps(setting, history, Transferred):
        return Transferred(iteration, last.genome, last.fitness, Cost(saved=allowance.rollouts))
    belief = belief_of(setting, history)
    search = _search(setting, belief, answers, allowance, setting.stream(iteration, "transfer"))
    transferred = strategy.transfer(belief, search, setting.stream(iteration, "transfer draws"))
    genome = setting.genomes.check(transferred, f"strategy {strategy.name!r}")
    return Transferred(iteration, genome, search.score_of(genome), answers.cost, _kept(strategy, search))


def _record(setting: Setting, history: History, iteration: int) -> Probed:
    """Return the record of an iteration whose reality is recorded: minus the error on samples that nothing saw.

    It is a share of the untuned simulator's; nan without such samples, or if the physics failed on one.
    """
    found, tests = history.simulators[0].held_out_error, len(setting.tests)
    if found is None:
        return Probed(iteration, nan, nan, left_out=True)
    untuned = setting.discrepancy.error(setting.untuned() / tests)
    share = setting.discrepancy.error(found / tests) / untuned if untuned else nan
    return Probed(iteration, nan, -share, left_out=True)


def _probe(setting: Setting, history: History, iteration: int, genome: Genome) -> Probed:
    """Return the probe of the transferred controller; one that was kept is not measured again."""
    if setting.candidates is not None:
        return _record(setting, history, iteration)
    if setting.probes == "never" or (setting.probes == "last" and iteration < setting.iterations):
        return probe_of(history, iteration, nan, left_out=True)
    if (last := history.probed) is not None and not last.left_out and _keeps(setting, history, Probed):
        return probe_of(history, iteration, last.fitness, last.readings, last.repeats)
    return probe_of(history, iteration, *_measure(setting, history, iteration, "probe", genome))


def _measure(
    setting: Setting, history: History, iteration: int, kind: Literal["sample", "probe"], genome: Genome
) -> Outcome:
    """Return what reality answers, with the noise of its measurement, which strategies know nothing about."""
    outcome = setting.reality(genome)
    deviation = setting.noise_unit or setting.noise * (history.scale or 1.0)
    if not deviation:
        return outcome
    rng = setting.stream(iteration, f"noise of a {kind}")
    fitness = outcome.fitness + deviation * float(rng.standard_normal())
    return Outcome(fitness, frozen(outcome.readings + rng.standard_normal(len(outcome.readings))))
