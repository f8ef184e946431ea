"""What the service shows of its studies, experiments, repetitions, samples and simulators.

Times are UTC. A fitness of null is a physics failure or a failed measurement; JSON has no nan.
"""

from datetime import datetime
from enum import StrEnum
from typing import Any, Generic, TypeVar

from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.schemas.lifecycle import Ending, State

T = TypeVar("T")


class Page(Frozen, Generic[T]):
    """A part of a list."""

    items: tuple[T, ...]
    next: str | None = Field(default=None, description="pass it as `cursor` for what follows; null at the end")


class Progress(Frozen):
    """How far it is, and what is left."""

    repetitions: int
    completed: int
    failed: int
    iterations: int = Field(description="of all repetitions, number 0 included")
    iterations_done: int
    rollouts: int = Field(description="budgeted in all; at the end, done plus saved, unless it was stopped")
    rollouts_done: int
    rollouts_failed: int = Field(description="physics failures (nan) among those done; they never win")
    rollouts_saved: int = Field(description="budgeted, but sure to change nothing, so not simulated")
    seconds_left: float | None = Field(default=None, description="null while unknown, 0 at the end")


class ExperimentRead(Frozen):
    """An experiment with its resolved spec; reality's parameters are null until it has ended."""

    id: str
    study: str | None = None
    name: str
    notes: str | None = Field(default=None, description="of people, about it")
    edits: int = Field(default=0, description="how often its name or notes were changed")
    strategy: str
    direct: bool = Field(
        default=False,
        description="true for the direct baseline: controllers evolve in reality itself, without simulators and samples, "
        "so iteration 0 is the only one",
    )
    state: State
    spec: dict[str, Any]
    priority: int = Field(default=0, description="the higher is computed first")
    max_parallel: int | None = Field(default=None, description="repetitions that run at once; null: any number")
    progress: Progress
    best_fitness: float | None = Field(
        default=None, description="the best recorded fitness of a repetition so far, on average over repetitions"
    )
    reasons: tuple[str, ...] = Field(default=(), description="why repetitions failed, each reason once")
    sensitivity: str | None = Field(default=None, description="id of the check of what its tunables do to fitness")
    warnings: tuple[str, ...] = Field(
        default=(), description="what that check found amiss, and versions that keep it from going on"
    )
    created_at: datetime
    started_at: datetime | None = None
    ended_at: datetime | None = None


class StudyRead(Frozen):
    """A study; its state is that of its experiments taken together."""

    id: str
    name: str
    notes: str | None = Field(default=None, description="of people, about it")
    edits: int = Field(default=0, description="how often its name or notes were changed")
    state: State
    experiments: tuple[ExperimentRead, ...]
    progress: Progress
    created_at: datetime


class RepetitionRead(Frozen):
    """One run of the whole algorithm with one stream of random numbers."""

    number: int
    state: State
    iterations_done: int
    rollouts_done: int
    attempts: int
    error: str | None = None
    started_at: datetime | None = None
    ended_at: datetime | None = None


class AttemptRead(Frozen):
    """One lease of a repetition: who had it, from when to when, and how it ended."""

    number: int = Field(description="from 1; the epoch that every write of this attempt carried")
    owner: str = Field(description="the supervisor")
    started_at: datetime
    ended_at: datetime | None = Field(default=None, description="null: it runs, or waits for its core")
    ending: Ending | None = None
    reason: str | None = Field(default=None, description="why it failed or was lost")


class MeasurementKind(StrEnum):
    """What a real-world evaluation is for: samples are learned from and counted, probes are only looked at."""

    SAMPLE = "sample"
    PROBE = "probe"


class SampleRead(Frozen):
    """A real-world evaluation."""

    repetition: int
    iteration: int
    kind: MeasurementKind
    genome: tuple[float, ...]
    fitness: float | None
    measured_by: str
    measured_at: datetime


class SimulatorRead(Frozen):
    """A tuned simulator; rank 0 is the best of its iteration."""

    repetition: int
    iteration: int
    rank: int
    parameters: dict[str, float]
    squared_error: float | None = Field(description="over the samples so far; null where its physics failed on one")
