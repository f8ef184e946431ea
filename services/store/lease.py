"""Leases of repetitions and sensitivity checks, and what the holder of a repetition delivers."""

from dataclasses import dataclass, field
from typing import TypeAlias

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.sensitivity import Checked
from gaplab.services.core.types import Step


@dataclass(frozen=True)
class Checkpoint:
    """A part of what simulators answered in the step under way, so that it need not be simulated again.

    Attributes:
        step: the place of the step in the log.
        part: its number within the step, from 0.
        answers: as `gaplab.services.core.answers` packs them.
        seconds: of work that they took.
    """

    step: int
    part: int
    answers: bytes
    seconds: float


@dataclass(frozen=True)
class Lease:
    """The right of one supervisor to a piece of work; a write with an old epoch or another owner is refused.

    Attributes:
        id: of the work.
        epoch: number of the lease among the leases of this work, from 1.
        owner: the supervisor. Its name is unique, so a lease never fits work of the same id in another database.
    """

    id: int | str
    epoch: int
    owner: str = field(default="", kw_only=True, compare=False)


@dataclass(frozen=True)
class Claim(Lease):
    """The lease of a repetition; equal to another of the same epoch.

    Attributes:
        experiment_id: of the repetition's experiment.
        number: of the repetition within its experiment, from 0.
        spec: of the experiment.
        log: the steps recorded so far, from which to go on.
        checkpoints: of the next step, if it was under way before.
    """

    id: int
    experiment_id: str
    number: int
    spec: ResolvedSpec = field(compare=False)
    log: tuple[Step, ...] = field(default=(), compare=False)
    checkpoints: tuple[Checkpoint, ...] = field(default=(), compare=False)


@dataclass(frozen=True)
class CheckClaim(Lease):
    """The lease of a sensitivity check.

    Attributes:
        spec: what is checked.
    """

    id: str
    spec: Checked = field(compare=False)


@dataclass(frozen=True)
class TimedStep:
    """A step, and the seconds of work that it took."""

    step: Step
    seconds: float


Delivered: TypeAlias = TimedStep | Checkpoint
"""What a worker delivers."""
