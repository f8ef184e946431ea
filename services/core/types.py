"""The values of the algorithm: immutable, self-checking, compared by content; and what a log of steps adds up to."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.random import Generator

from gaplab.services.core.arrays import (
    NO_GENOMES,
    NO_READINGS,
    FloatArray,
    Genome,
    Genomes,
    Parameters,
    Readings,
    no_readings,
)
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.discrepancies.fitness import SquaredFitness
from gaplab.services.core.space import Space


class Outcome(NamedTuple):
    """What reality answers about one genome.

    Attributes:
        fitness: its fitness; nan if the measurement failed.
        readings: `(q,)`: what the sensors said, each divided by its noise; empty if the robot has none.
    """

    fitness: float
    readings: Readings = NO_READINGS


@dataclass(frozen=True, eq=False)
class Sample:
    """A genome with its outcome in reality.

    Attributes:
        genome: `(g,)`.
        fitness: nan if the measurement failed, which counts but is not learned from.
        readings: `(q,)`: what the sensors said, each divided by its noise; empty if there are none.
        repeats: `(r,)`: the values whose mean is the fitness; empty if it is one value.
    """

    genome: Genome
    fitness: float
    readings: Readings = field(default_factory=no_readings)
    repeats: FloatArray = field(default_factory=no_readings)

    @property
    def outcome(self) -> FloatArray:
        """Return `(1 + q,)`: fitness, then readings."""
        return np.append(self.fitness, self.readings)


def learnable(samples: Iterable[Sample]) -> tuple[Sample, ...]:
    """Return the samples whose measurement succeeded."""
    return tuple(each for each in samples if np.isfinite(each.fitness))


@dataclass(frozen=True, eq=False)
class Fit:
    """How well a simulator reproduces the samples, compared with what noise and rough physics alone would leave.

    Attributes:
        expected_error: the discrepancy that they would leave, as large as `squared_error`.
        surprise: share of right simulators that leave as much; small if no simulator reproduces the samples.
        interval_scale: factor of the half widths of intervals, at least 1.
        reading_errors: `(q,)`: root mean square difference of each reading over samples, in units of its noise; empty
            unless readings were compared.
        noise: `(p,)`: standard deviation of each tunable by the noise of the measurements alone; empty if it was not
            computed.
    """

    expected_error: float
    surprise: float
    interval_scale: float
    reading_errors: FloatArray = field(default_factory=no_readings)
    noise: FloatArray = field(default_factory=no_readings)


@dataclass(frozen=True, eq=False)
class Simulator:
    """One setting of the tunables, with its discrepancy from the samples that it was tuned on.

    Attributes:
        parameters: `(p,)`, in the order of the spec's tunables.
        squared_error: the discrepancy, by default Σ(f_sim − f_real)²; at least 0; 0 before any sample, inf where the
            physics failed on one.
        interval: `(p, 2)`: ends of the 95 % interval of each tunable; None if the tuner gives none.
        weight: share of the posterior probability; None if the tuner gives none.
        held_out_error: the discrepancy from the held-out samples, which only the best simulator has; None without
            any, or where the physics failed on one.
        fit: how well it reproduces the samples, which only the best simulator has; None if the noise is unknown.
    """

    parameters: FloatArray
    squared_error: float = 0.0
    interval: FloatArray | None = None
    weight: float | None = None
    held_out_error: float | None = None
    fit: Fit | None = None


@dataclass(frozen=True, eq=False)
class Belief:
    """Everything that a strategy may know: the samples so far, and simulators tuned on them, best first.

    Attributes:
        space: space of genomes.
        known: `(g,)`: the robot's hand-designed genome.
        samples: samples in the order of measurement.
        simulators: one simulator or a diverse ensemble; random before the first sample.
        tunables: space of simulators.
        names: `(p,)`, names of the tunables, in the order of simulators' parameters.
        scale: about the fitness that evolution in reality would reach, above 0. It is the fitness in simulation of the
            first transferred controller; 1 for a strategy that searches for none.
        discrepancy: what `simulators` were tuned to minimise.
        candidates: `(n, g)`: the recordings that are left to select from, which have readings and no fitness; None if
            any genome of the space may be tried.
        commands: `(n, c)`: what was commanded in recording 0 to n - 1, nan after its end; None if nothing was.
        members: `(n, g)`: the final population of the latest search of a strategy that `continues`; else none.
        reading_times_s, reading_periods: `(q,)`: time of each reading, and its period over its noise; 0 for none.
    """

    space: Space
    known: Genome
    samples: tuple[Sample, ...]
    simulators: tuple[Simulator, ...]
    tunables: Space
    names: tuple[str, ...]
    scale: float = 1.0
    discrepancy: Discrepancy = field(default_factory=SquaredFitness)
    candidates: Genomes | None = None
    commands: FloatArray | None = None
    members: Genomes = field(default_factory=lambda: NO_GENOMES)
    reading_times_s: FloatArray = field(default_factory=no_readings)
    reading_periods: FloatArray = field(default_factory=no_readings)

    def at_most(self, evaluations: int) -> int:
        """Return how many of these evaluations a selection can use: as many as there are candidates."""
        return evaluations if self.candidates is None else min(evaluations, len(self.candidates))

    def draw(self, count: int, rng: Generator) -> Genomes:
        """Return genomes that may be tried, drawn uniformly: `(count, g)`; of candidates no more than there are."""
        if self.candidates is None:
            return self.space.draw(count, rng)
        return self.candidates[rng.permutation(len(self.candidates))[:count]]

    @property
    def parameters(self) -> Parameters:
        """Return the parameters `(m, p)` of all simulators."""
        return np.array([each.parameters for each in self.simulators])

    @property
    def squared_errors(self) -> FloatArray:
        """Return the squared errors `(m,)` of all simulators."""
        return np.array([each.squared_error for each in self.simulators])

    @property
    def learnable(self) -> tuple[Sample, ...]:
        """Return the samples whose measurement succeeded."""
        return learnable(self.samples)


@dataclass(frozen=True)
class Budget:
    """Fitness evaluations of each search; the paper's numbers are the defaults. Source: sections 2 and 3.

    Attributes:
        reuse_transfer: true if a strategy whose search has the transfer's goal tries the transferred controller. It
            then selects from a search of `controller_evaluations`, other strategies from `selection_evaluations`.
    """

    controller_evaluations: int = 10_000
    selection_evaluations: int = 10_000
    simulator_evaluations: int = 2_000
    reuse_transfer: bool = False


@dataclass(frozen=True)
class Cost:
    """Cost of a step.

    Attributes:
        rollouts: number of simulated rollouts.
        failures: number of those that failed (nan).
        saved: budgeted rollouts that could not change the result, and were not simulated.
    """

    rollouts: int = 0
    failures: int = 0
    saved: int = 0


@dataclass(frozen=True, eq=False)
class Selected:
    """The genome to try in reality next.

    Attributes:
        told: true if it does not follow from the steps before, since a person chose it; false if the strategy did.
        members: `(n, g)`: the final population of the search, of a strategy that `continues`; else none.
    """

    iteration: int
    genome: Genome
    cost: Cost = field(default_factory=Cost)
    told: bool = False
    members: Genomes = field(default_factory=lambda: NO_GENOMES)


@dataclass(frozen=True, eq=False)
class Measured:
    """Reality answered: one more sample."""

    iteration: int
    sample: Sample


@dataclass(frozen=True, eq=False)
class Tuned:
    """New simulators, best first, fitted to all samples so far; drawn at random in iteration 0."""

    iteration: int
    simulators: tuple[Simulator, ...]
    cost: Cost = field(default_factory=Cost)


@dataclass(frozen=True, eq=False)
class Transferred:
    """A controller was evolved in simulation, for a probe in reality.

    Attributes:
        fitness: score of the strategy's search, by default the fitness in the best simulator; nan if it is unknown, or
            the physics failed for every controller tried.
        members: as of Selected.
    """

    iteration: int
    genome: Genome
    fitness: float
    cost: Cost = field(default_factory=Cost)
    members: Genomes = field(default_factory=lambda: NO_GENOMES)


@dataclass(frozen=True)
class Probed:
    """The fitness of the transferred controller in reality was recorded; it is never learned from or counted.

    Attributes:
        fitness: fitness in reality; nan if the measurement failed.
        recorded: the larger of this and the best sample's fitness, which the curve shows. Source: section 3.
        readings: `(q,)`: what the sensors said, each divided by its noise; empty if there are none.
        repeats: `(r,)`: the values whose mean is the fitness; empty if it is one value.
        left_out: true if the spec asks for no probe of this iteration; its fitness is nan then.
    """

    iteration: int
    fitness: float
    recorded: float
    readings: Readings = field(default_factory=no_readings, compare=False)
    repeats: FloatArray = field(default_factory=no_readings, compare=False)
    left_out: bool = False


Step: TypeAlias = Selected | Measured | Tuned | Transferred | Probed

_ORDER = (Selected, Measured, Tuned, Transferred, Probed)

LENGTH = len(_ORDER)
"""Places of an iteration in a log."""


def place_of(step: Step) -> int:
    """Return the step's fixed place in a log, from 0. Iteration 0 has no Selected and no Measured."""
    return LENGTH * step.iteration + _ORDER.index(type(step)) - _ORDER.index(Tuned)


def next_place(log: Sequence[Step]) -> int:
    """Return the place after the last step of a log."""
    return place_of(log[-1]) + 1 if log else 0


def may_follow(step: Step, place: int) -> bool:
    """Return whether a step may follow a log whose next place is this one.

    That of this place may. So may a sample that a person chose, in place of what tuning, transfer and probe would have
    been, which nobody has asked for.
    """
    left_out = place_of(step) - place
    return left_out == 0 or (isinstance(step, Selected) and step.told and 0 < left_out <= LENGTH - 2)


@dataclass(frozen=True, eq=False)
class History:
    """The result of the steps so far.

    Attributes:
        last: the latest step; None at the very start.
        samples: samples measured so far.
        simulators: simulators of the latest tuning, best first.
        transferred: the latest transferred controller.
        probed: its latest probe.
        scale: absolute fitness in simulation of the first transferred controller that has one; None without any.
        seen: number of samples before the latest step of each kind.
        members: `(n, g)`: the latest final population of a search that was kept; none before.
    """

    last: Step | None = None
    samples: tuple[Sample, ...] = ()
    simulators: tuple[Simulator, ...] = ()
    transferred: Transferred | None = None
    probed: Probed | None = None
    scale: float | None = None
    seen: Mapping[type[Step], int] = field(default_factory=dict)
    members: Genomes = field(default_factory=lambda: NO_GENOMES)

    def after(self, step: Step) -> "History":
        """Return the history with one more step."""
        now = replace(self, last=step, seen={**self.seen, type(step): len(self.samples)})
        if isinstance(step, Selected | Transferred) and len(step.members):
            now = replace(now, members=step.members)
        match step:
            case Measured(sample=sample):
                return replace(now, samples=(*self.samples, sample))
            case Tuned(simulators=simulators):
                return replace(now, simulators=simulators)
            case Transferred(fitness=fitness):
                return replace(now, transferred=step, scale=self.scale or _size(fitness))
            case Probed():
                return replace(now, probed=step)
        return now


def _size(fitness: float) -> float | None:
    """Return the absolute value of a fitness; None for nan, an infinity or 0, which are not scales."""
    return abs(fitness) or None if np.isfinite(fitness) else None


def probe_of(
    history: History,
    iteration: int,
    fitness: float,
    readings: Readings = NO_READINGS,
    repeats: FloatArray = NO_READINGS,
    *,
    left_out: bool = False,
) -> Probed:
    """Return the probe with this outcome, after these steps."""
    recorded = recorded_fitness(fitness, history.samples)
    return Probed(iteration, fitness, recorded, readings, repeats, left_out)


def recorded_fitness(probe: float, samples: Iterable[Sample]) -> float:
    """Return the larger fitness of the probe and the best sample; nan if every measurement failed.

    It can fall from one iteration to the next. Only its floor, the best sample so far, cannot.

    Source: paper, section 3.
    """
    measured = [value for value in (probe, *(each.fitness for each in samples)) if np.isfinite(value)]
    return max(measured, default=float("nan"))
