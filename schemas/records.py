"""What the service shows of its studies, experiments, repetitions, samples and simulators.

Times are UTC. A fitness of null is a physics failure or a failed measurement; JSON has no nan.
"""

from enum import StrEnum
from typing import Any, Generic, TypeVar

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Moment, PluginName, Statistic
from gaplab.schemas.lifecycle import Ending, State

T = TypeVar("T")


class Page(Frozen, Generic[T]):
    """A part of a list."""

    items: tuple[T, ...]
    next: str | None = Field(
        default=None, description="pass it as `cursor` for what follows; null at the end", examples=["WyIyMDEyIl0"]
    )


class Progress(Frozen):
    """How far it is, and what is left."""

    repetitions: int = Field(examples=[40])
    completed: int = Field(examples=[12])
    failed: int
    iterations: int = Field(description="of all repetitions, number 0 included", examples=[440])
    iterations_done: int = Field(examples=[150])
    rollouts: int = Field(description="budgeted in all; at the end, done plus saved, unless it was stopped")
    rollouts_done: int = Field(examples=[4_363_000])
    rollouts_failed: int = Field(description="physics failures (nan) among those done; they never win")
    rollouts_saved: int = Field(description="budgeted, but sure to change nothing, so not simulated")
    seconds_left: float | None = Field(default=None, description="null while unknown, 0 at the end", examples=[3120.0])


class ExperimentRead(Frozen):
    """An experiment with its resolved spec; reality's parameters are null until it has ended."""

    id: Id
    study: Id | None = None
    name: PluginName
    notes: str | None = Field(default=None, description="of people, about it", examples=["the bounds were too wide"])
    edits: int = Field(default=0, description="how often its name or notes were changed")
    strategy: PluginName
    state: State
    spec: dict[str, Any] = Field(
        examples=[{"strategy": {"name": "simulated_fit"}, "iterations": 10, "repetitions": 40}]
    )
    priority: int = Field(default=0, description="the higher is computed first")
    max_parallel: int | None = Field(default=None, description="repetitions that run at once; null: any number")
    progress: Progress
    best_fitness: Statistic = Field(
        default=None, description="the best recorded fitness of a repetition so far, on average over repetitions"
    )
    reasons: tuple[str, ...] = Field(default=(), description="why repetitions failed, each reason once")
    sensitivity: Id | None = Field(default=None, description="id of the check of what its tunables do to fitness")
    warnings: tuple[str, ...] = Field(
        default=(), description="what that check found amiss, and versions that keep it from going on"
    )
    created_at: Moment
    started_at: Moment | None = None
    ended_at: Moment | None = None


class StudyRead(Frozen):
    """A study; its state is that of its experiments taken together."""

    id: Id
    name: PluginName
    notes: str | None = Field(default=None, description="of people, about it", examples=["the bounds were too wide"])
    edits: int = Field(default=0, description="how often its name or notes were changed")
    state: State
    experiments: tuple[ExperimentRead, ...]
    progress: Progress
    created_at: Moment


class RepetitionRead(Frozen):
    """One run of the whole algorithm with one stream of random numbers."""

    number: int
    state: State
    iterations_done: int
    rollouts_done: int
    attempts: int
    error: str | None = Field(default=None, examples=["the engine pybullet is not installed"])
    started_at: Moment | None = None
    ended_at: Moment | None = None


class AttemptRead(Frozen):
    """One lease of a repetition: who had it, from when to when, and how it ended."""

    number: int = Field(description="from 1; the epoch that every write of this attempt carried")
    owner: str = Field(description="the supervisor", examples=["lab-3:4711:9f2c61d0"])
    started_at: Moment
    ended_at: Moment | None = Field(default=None, description="null: it runs, or waits for its core")
    ending: Ending | None = None
    reason: str | None = Field(
        default=None, description="why it failed or was lost", examples=["no heartbeat for 30 s"]
    )


class MeasurementKind(StrEnum):
    """What a real-world evaluation is for: samples are learned from and counted, probes are only looked at."""

    SAMPLE = "sample"
    PROBE = "probe"


class SampleRead(Frozen):
    """A real-world evaluation."""

    repetition: int
    iteration: int
    kind: MeasurementKind
    genome: tuple[float, ...] = Field(examples=[(0.12, 0.55, 0.83, 0.31)])
    fitness: Statistic
    measured_by: str = Field(examples=["pybullet"])
    measured_at: Moment


class SimulatorRead(Frozen):
    """A tuned simulator; rank 0 is the best of its iteration."""

    repetition: int
    iteration: int
    rank: int
    parameters: dict[str, float] = Field(examples=[{"static_friction": 1.04, "restitution": 0.02}])
    squared_error: Statistic = Field(description="over the samples so far; null where its physics failed on one")
