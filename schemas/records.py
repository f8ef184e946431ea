"""Studies, experiments, repetitions, samples and simulators, as the API returns them.

Times are UTC. A fitness of null means failed physics or a failed measurement; JSON has no nan.
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
    next: str | None = Field(default=None, description="pass it as `cursor` for the next page; null on the last")


class Progress(Frozen):
    """Completed and remaining work."""

    repetitions: int
    completed: int
    failed: int
    iterations: int = Field(description="iterations of all repetitions, including number 0")
    iterations_done: int
    rollouts: int = Field(description="budgeted rollouts; at the end, done plus saved, unless stopped")
    rollouts_done: int
    rollouts_failed: int = Field(description="rollouts done whose physics failed (nan); they never win")
    rollouts_saved: int = Field(
        description="budgeted rollouts that were not simulated, because they cannot change a number"
    )
    seconds_left: float | None = Field(
        default=None, description="expected remaining time; null while unknown, 0 at the end"
    )


class ExperimentRead(Frozen):
    """An experiment with its resolved spec. Reality's parameters are null until it and its study have ended."""

    id: str
    study: str | None = None
    name: str
    notes: str | None = Field(default=None, description="free text by people")
    edits: int = Field(default=0, description="number of changes to the name or notes")
    strategy: str
    direct: bool = Field(
        default=False,
        description="true for the direct baseline: controllers evolve in reality itself, without simulators and "
        "samples, so iteration 0 is the only one",
    )
    state: State
    spec: dict[str, Any]
    priority: int = Field(default=0, description="higher is computed first")
    max_parallel: int | None = Field(default=None, description="largest number of repetitions at once; null: no limit")
    progress: Progress
    best_fitness: float | None = Field(
        default=None, description="best recorded fitness of each repetition so far, averaged over repetitions"
    )
    reasons: tuple[str, ...] = Field(default=(), description="distinct reasons of failed repetitions")
    sensitivity: str | None = Field(default=None, description="id of the sensitivity check")
    warnings: tuple[str, ...] = Field(
        default=(), description="findings of the sensitivity check, and versions that prevent continuing"
    )
    created_at: datetime
    started_at: datetime | None = None
    ended_at: datetime | None = None


class StudyRead(Frozen):
    """A study; its state combines those of its experiments."""

    id: str
    name: str
    notes: str | None = Field(default=None, description="free text by people")
    edits: int = Field(default=0, description="number of changes to the name or notes")
    state: State
    experiments: tuple[ExperimentRead, ...]
    progress: Progress
    created_at: datetime


class RepetitionRead(Frozen):
    """One run of the whole algorithm with its own random numbers."""

    number: int
    state: State
    iterations_done: int
    rollouts_done: int
    attempts: int
    error: str | None = None
    started_at: datetime | None = None
    ended_at: datetime | None = None


class AttemptRead(Frozen):
    """One attempt at a repetition: its supervisor, times and ending."""

    number: int = Field(description="from 1; every write of the attempt carries it as the epoch of its lease")
    owner: str = Field(description="supervisor of the attempt")
    started_at: datetime
    ended_at: datetime | None = Field(default=None, description="null while it runs or waits for a core")
    ending: Ending | None = None
    reason: str | None = Field(default=None, description="reason of failure or loss")


class MeasurementKind(StrEnum):
    """Purpose of a real-world evaluation: samples are learned from and counted, probes are only recorded."""

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
    squared_error: float | None = Field(description="sum over the samples so far; null if the physics failed on one")
