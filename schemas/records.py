"""Studies, experiments, repetitions, samples and simulators, as the API returns them.

Times are UTC. A fitness of null means failed physics or a failed measurement; JSON has no nan.
"""

from collections.abc import Sequence
from enum import StrEnum
from typing import Any, Generic, TypeVar

from pydantic import Field

from gaplab.schemas.base import Id, Moment, Name, Read, Statistic, table
from gaplab.schemas.curves import from_before
from gaplab.schemas.lifecycle import Ending, State

T = TypeVar("T")


class Page(Read, Generic[T]):
    """A part of a list."""

    items: tuple[T, ...]
    next: str | None = Field(
        None, description="pass it as `cursor` for the next page; null on the last", examples=["WyIyMDEyIl0"]
    )

    def _repr_html_(self) -> str:
        return table(self.items)


class TimeLeft(Read):
    """Interval of the remaining time, from the pace so far. It narrows as more work is done."""

    low_s: float = Field(examples=[2400.0])
    high_s: float = Field(examples=[4200.0])
    text: str = Field(examples=["40 to 70 min"])


class StepRead(Read):
    """A step that a repetition has begun, as of its last checkpoint; steps of less than ten seconds have none."""

    repetition: int
    iteration: int = Field(examples=[3])
    kind: str = Field(description="selection, tuning or transfer", examples=["tuning"])
    rollouts: int = Field(description="rollouts done", examples=[4100])
    budget: int = Field(description="most rollouts of the step; it saves the others", examples=[10_000])


class Progress(Read):
    """Completed and remaining work."""

    repetitions: int = Field(examples=[40])
    completed: int = Field(examples=[12])
    failed: int
    iterations: int = Field(description="iterations of all repetitions, including number 0", examples=[440])
    iterations_done: int = Field(description="completed iterations, including number 0", examples=[150])
    counted_iterations: int = Field(
        0, description="iterations of all repetitions as a spec counts them, without number 0", examples=[400]
    )
    counted_iterations_done: int = Field(0, description="those that are completed", examples=[138])
    rollouts: int = Field(
        description="budgeted rollouts: in the end those done plus those saved, unless the experiment was stopped"
    )
    rollouts_done: int = Field(description="those of `steps` too", examples=[4_363_000])
    rollouts_failed: int = Field(description="rollouts done whose physics failed (nan); they never win")
    rollouts_saved: int = Field(
        description="budgeted rollouts that were not simulated, because they cannot change a number"
    )
    time_left: TimeLeft | None = Field(
        None, description="interval of the remaining time; null until enough is measured, and at the end"
    )
    steps: tuple[StepRead, ...] = Field((), description="what repetitions have begun")
    share: float = Field(description="share of the work that is done, between 0 and 1, by rollouts", examples=[0.37])
    text: str = Field(
        description="completed work and the steps under way, in words",
        examples=["12 of 40 repetitions; 138 of 400 iterations; 4,363,000 of 12,000,000 rollouts; tuning 3: 41 %"],
    )


class FitnessRead(Read):
    """A point of the curve: recorded fitness after a number of real-world evaluations.

    The number is the last that every repetition counted here has reached: the COMPLETED ones; without any, those that
    have begun.
    """

    evaluations: int = Field(examples=[10])
    known: int = Field(0, description="samples from before the experiment, which `evaluations` does not count")
    n: int = Field(description="repetitions in the mean", examples=[40])
    mean: float = Field(examples=[0.585])
    sd: Statistic = Field(description="sample standard deviation")

    @property
    def text(self) -> str:
        """It as a cell of a table: `0.585 ± 0.1 after 10`."""
        sd = "" if self.sd is None else f" ± {self.sd:.2g}"
        return f"{self.mean:.3g}{sd} after {self.evaluations}{from_before(self.known)}"


class BestRead(FitnessRead):
    """The fittest experiment of a study, after the last number of real-world evaluations that its experiments share.

    It is the fittest of those with the most repetitions. An experiment without samples takes part with its only value;
    the direct baseline, only if there is no other.
    """

    experiment: Id
    name: Name
    strategy: Name

    @property
    def text(self) -> str:
        """It as a cell of a table, with the experiment's name."""
        return f"{self.name} {super().text}"


class SensorsRead(Read):
    """The sensors of a robot, and the times at which all of them are read; it may have none."""

    names: tuple[str, ...] = Field(examples=[("roll", "height")])
    units: tuple[str, ...] = Field(examples=[("rad", "m")])
    noises: tuple[float, ...] = Field(
        description="standard deviation of each sensor's noise, in its unit", examples=[(0.02, 0.005)]
    )
    times_s: tuple[float, ...] = Field(description="seconds from the start of a rollout", examples=[(0.75, 1.0)])
    needed: bool = Field(
        False, description="true: an answer without readings is refused, since the experiment tunes on them"
    )


class ExperimentRead(Read):
    """An experiment with its resolved spec. Reality's parameters are null until all of its study have ended."""

    id: Id
    name: Name
    study: Id = Field(description="id of its study: its own, if it was submitted alone")
    strategy: Name
    direct: bool = Field(
        False,
        description="true for the direct baseline: controllers evolve in reality itself, without simulators and "
        "samples, so iteration 0 is the only one",
    )
    level: bool = Field(False, description="true for a strategy without samples: iteration 0 only")
    state: State
    spec: dict[str, Any] = Field(
        examples=[{"strategy": {"name": "simulated_fit"}, "iterations": 10, "repetitions": 40}]
    )
    sensors: SensorsRead | None = Field(
        None,
        description="sensors of its robot, which the readings of its samples come from; null in lists, in studies, in "
        "answers to changes, and if the robot is not installed",
    )
    priority: int = Field(0, description="the highest priority is computed first")
    max_parallel: int | None = Field(None, description="largest number of repetitions at once; null: no limit")
    progress: Progress
    caveat: str | None = Field(
        None,
        description="what the state does not say: it was stopped early, or repetitions failed; null: nothing",
        examples=["stopped early, 57 % done"],
    )
    fitness: FitnessRead | None = Field(
        None, description="the curve's mean after the last common number of evaluations; null: no result yet"
    )
    best_fitness: Statistic = Field(
        None,
        description="best recorded fitness of each repetition so far, averaged over repetitions; it lies above the "
        "curve, since each repetition has its maximum elsewhere. To compare strategies, use `fitness`",
    )
    reasons: tuple[str, ...] = Field(
        (), description="why it was paused, if not by a person; then the distinct reasons of failed repetitions"
    )
    sensitivity: Id | None = Field(None, description="id of the sensitivity check")
    doubts: tuple[str, ...] = Field((), description="measurements that are unlikely, until a person confirms")
    warnings: tuple[str, ...] = Field(
        (), description="these, findings of the sensitivity check, and versions that prevent continuing"
    )
    created_at: Moment
    started_at: Moment | None = None
    ended_at: Moment | None = None


class StudyRead(Read):
    """A study; its state combines those of its experiments.

    Asked for by the id of one experiment, it has that one alone, with its id and name.
    """

    id: Id
    name: Name
    notes: str | None = Field(
        None, description="Markdown by people; `/notes` has it as HTML", examples=["the bounds were *too wide*"]
    )
    tags: tuple[str, ...] = Field((), description="tags by people", examples=[("gait", "paper")])
    edits: int = Field(0, description="number of changes to the name, notes or tags")
    archived_at: Moment | None = Field(None, description="time since which lists leave it out; null: they do not")
    state: State
    caveat: str | None = Field(
        None,
        description="what the state does not say: experiments were stopped early, cancelled, or failed; null: nothing",
        examples=["1 of 7 experiments cancelled, 81 % done"],
    )
    best: BestRead | None = Field(None, description="the fittest experiment; null: no result yet")
    experiments: tuple[ExperimentRead, ...]
    progress: Progress
    created_at: Moment


def common_count(experiments: Sequence[ExperimentRead]) -> int | None:
    """Return the last number of real-world evaluations that experiments share; None if none has a fitness.

    An experiment without samples has a single value, which is compared with every number. Experiments that failed or
    were cancelled lower the number only if no other has a fitness.
    """
    found = [each for each in experiments if each.fitness]
    found = [each for each in found if not each.level] or found
    lasting = [each for each in found if each.state not in {State.FAILED, State.CANCELLED}] or found
    return min((each.fitness.evaluations for each in lasting if each.fitness), default=None)


class RepetitionRead(Read):
    """One run of the whole algorithm with its own random numbers."""

    number: int
    state: State
    iterations_done: int = Field(description="completed iterations, including number 0")
    rollouts_done: int
    attempts: int
    error: str | None = Field(None, examples=["the engine pybullet is not installed"])
    measuring_at: Moment | None = Field(None, description="time since which it waits for reality's answer")
    started_at: Moment | None = None
    ended_at: Moment | None = None


class AttemptRead(Read):
    """One attempt at a repetition: its supervisor, times and ending."""

    number: int = Field(description="from 1; every write of the attempt carries it as the epoch of its lease")
    owner: str = Field(description="supervisor of the attempt", examples=["lab-3:4711:9f2c61d0"])
    started_at: Moment
    ended_at: Moment | None = Field(None, description="null while it runs or waits for a core")
    ending: Ending | None = None
    reason: str | None = Field(None, description="reason of failure or loss", examples=["no heartbeat for 30 s"])


class MeasurementKind(StrEnum):
    """Purpose of a real-world evaluation: samples are learned from and counted, probes are only recorded."""

    SAMPLE = "sample"
    PROBE = "probe"


class SampleRead(Read):
    """A real-world evaluation: the genome, its fitness and its readings."""

    repetition: int
    iteration: int
    kind: MeasurementKind
    genome: tuple[float, ...] = Field(examples=[(0.12, 0.55, 0.83, 0.31)])
    fitness: Statistic
    readings: tuple[float | None, ...] | None = Field(
        None,
        description="what the sensors said, each divided by its noise, all sensors at one time after the other; null: "
        "the robot has none, or a sensor failed",
        examples=[(0.4, -1.2, None)],
    )
    repeats: tuple[float, ...] | None = Field(
        None, description="values whose mean is the fitness; null: it is a single value", examples=[(0.4, 0.44)]
    )
    standard_error: Statistic = Field(
        None, description="standard error of the fitness, from its repeats; null: it is a single value"
    )
    measured_by: str = Field(examples=["pybullet"])
    measured_at: Moment


class SimulatorRead(Read):
    """A tuned simulator; rank 0 is the best of its iteration."""

    repetition: int
    iteration: int
    rank: int
    parameters: dict[str, float] = Field(examples=[{"static_friction": 1.04, "restitution": 0.02}])
    squared_error: Statistic = Field(
        description="discrepancy, summed over the samples so far, which grows with their number; by default squared "
        "differences in fitness; null if the physics failed on one"
    )
    error: Statistic = Field(
        None,
        description="error per sample, in the unit of the discrepancy; by default the root mean square difference in "
        "fitness; null without samples too",
    )
    intervals: dict[str, tuple[float, float]] | None = Field(
        None,
        description="95 % interval of each tunable, if the tuner gives them",
        examples=[{"dynamic_friction": (0.7, 0.9)}],
    )
    expected_error: Statistic = Field(
        None, description="error that noise and rough physics alone would leave; null if noise is unknown"
    )
    surprise: Statistic = Field(
        None,
        description="share of right simulators that leave as much error; up to 0.05, no simulator reproduces the "
        "samples. Intervals are widened by what is left",
    )
    weight: Statistic = Field(None, description="share of the posterior probability, if the tuner gives it")
    held_out_error: Statistic = Field(None, description="discrepancy from held-out samples, of rank 0")
