"""Studies, experiments, repetitions, samples and simulators, as the API returns them.

Times are UTC. A fitness of null means failed physics or a failed measurement; JSON has no nan.
"""

from enum import StrEnum
from typing import Any, Generic, TypeVar

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Moment, Name, Statistic
from gaplab.schemas.lifecycle import Ending, State

T = TypeVar("T")


class Page(Frozen, Generic[T]):
    """A part of a list."""

    items: tuple[T, ...]
    next: str | None = Field(
        default=None, description="pass it as `cursor` for the next page; null on the last", examples=["WyIyMDEyIl0"]
    )


class Progress(Frozen):
    """Completed and remaining work."""

    repetitions: int = Field(examples=[40])
    completed: int = Field(examples=[12])
    failed: int
    iterations: int = Field(description="iterations of all repetitions, including number 0", examples=[440])
    iterations_done: int = Field(examples=[150])
    rollouts: int = Field(
        description="budgeted rollouts: in the end those done plus those saved, unless the experiment was stopped"
    )
    rollouts_done: int = Field(examples=[4_363_000])
    rollouts_failed: int = Field(description="rollouts done whose physics failed (nan); they never win")
    rollouts_saved: int = Field(
        description="budgeted rollouts that were not simulated, because they cannot change a number"
    )
    seconds_left: float | None = Field(
        default=None, description="expected remaining time; null while unknown, 0 at the end", examples=[3120.0]
    )


class ExperimentRead(Frozen):
    """An experiment with its resolved spec. Reality's parameters are null until it and its study have ended."""

    id: Id
    study: Id | None = None
    name: Name
    notes: str | None = Field(
        default=None, description="Markdown by people; `/notes` has it as HTML", examples=["the bounds were *too wide*"]
    )
    tags: tuple[str, ...] = Field(default=(), description="tags by people", examples=[("gait", "paper")])
    edits: int = Field(default=0, description="number of changes to the name, notes or tags")
    archived_at: Moment | None = Field(
        default=None, description="time since which lists leave it out; null: they do not"
    )
    strategy: Name
    direct: bool = Field(
        default=False,
        description="true for the direct baseline: controllers evolve in reality itself, without simulators and "
        "samples, so iteration 0 is the only one",
    )
    state: State
    spec: dict[str, Any] = Field(
        examples=[{"strategy": {"name": "simulated_fit"}, "iterations": 10, "repetitions": 40}]
    )
    priority: int = Field(default=0, description="the highest priority is computed first")
    max_parallel: int | None = Field(default=None, description="largest number of repetitions at once; null: no limit")
    progress: Progress
    best_fitness: Statistic = Field(
        default=None, description="best recorded fitness of each repetition so far, averaged over repetitions"
    )
    reasons: tuple[str, ...] = Field(
        default=(), description="why it was paused, if not by a person; then the distinct reasons of failed repetitions"
    )
    sensitivity: Id | None = Field(default=None, description="id of the sensitivity check")
    warnings: tuple[str, ...] = Field(
        default=(), description="findings of the sensitivity check, and versions that prevent continuing"
    )
    created_at: Moment
    started_at: Moment | None = None
    ended_at: Moment | None = None


class StudyRead(Frozen):
    """A study; its state combines those of its experiments."""

    id: Id
    name: Name
    notes: str | None = Field(
        default=None, description="Markdown by people; `/notes` has it as HTML", examples=["the bounds were *too wide*"]
    )
    tags: tuple[str, ...] = Field(default=(), description="tags by people", examples=[("gait", "paper")])
    edits: int = Field(default=0, description="number of changes to the name, notes or tags")
    archived_at: Moment | None = Field(
        default=None, description="time since which lists leave it out; null: they do not"
    )
    state: State
    experiments: tuple[ExperimentRead, ...]
    progress: Progress
    created_at: Moment


class NotesRead(Frozen):
    """Notes as HTML."""

    html: str = Field(
        description="the notes, rendered: without scripts, images or HTML of their own",
        examples=["<p>the bounds were <em>too wide</em></p>"],
    )


class DeletionRead(Frozen):
    """A deleted study or experiment."""

    id: Id
    name: Name
    study: Id | None = Field(default=None, description="study of a deleted experiment")
    deleted_at: Moment


class RepetitionRead(Frozen):
    """One run of the whole algorithm with its own random numbers."""

    number: int
    state: State
    iterations_done: int
    rollouts_done: int
    attempts: int
    error: str | None = Field(default=None, examples=["the engine pybullet is not installed"])
    measuring_at: Moment | None = Field(default=None, description="time since which it waits for reality's answer")
    started_at: Moment | None = None
    ended_at: Moment | None = None


class AttemptRead(Frozen):
    """One attempt at a repetition: its supervisor, times and ending."""

    number: int = Field(description="from 1; every write of the attempt carries it as the epoch of its lease")
    owner: str = Field(description="supervisor of the attempt", examples=["lab-3:4711:9f2c61d0"])
    started_at: Moment
    ended_at: Moment | None = Field(default=None, description="null while it runs or waits for a core")
    ending: Ending | None = None
    reason: str | None = Field(
        default=None, description="reason of failure or loss", examples=["no heartbeat for 30 s"]
    )


class MeasurementKind(StrEnum):
    """Purpose of a real-world evaluation: samples are learned from and counted, probes are only recorded."""

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
    squared_error: Statistic = Field(description="sum over the samples so far; null if the physics failed on one")
