"""A repetition, or a sensitivity check, in the hands of one supervisor, and what it delivers."""

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
        answers: as `gaplab.services.core.recall` packs them.
        seconds: of work that they took.
    """

    step: int
    part: int
    answers: bytes
    seconds: float


@dataclass(frozen=True)
class Claim:
    """The right to go on with a repetition, until its epoch is over; equal to another of the same epoch.

    Attributes:
        repetition_id: in the store.
        epoch: of the lease; a write that carries an old one is refused.
        experiment_id: whose repetition it is.
        number: of the repetition within its experiment, from 0.
        spec: of the experiment.
        log: the steps recorded so far, from which to go on.
        checkpoints: of the step that comes next, if it was under way before.
    """

    repetition_id: int
    epoch: int
    experiment_id: str
    number: int
    spec: ResolvedSpec = field(compare=False)
    log: tuple[Step, ...] = field(default=(), compare=False)
    checkpoints: tuple[Checkpoint, ...] = field(default=(), compare=False)


@dataclass(frozen=True)
class TimedStep:
    """A step, and the seconds of work that it took."""

    step: Step
    seconds: float


Delivered: TypeAlias = TimedStep | Checkpoint
"""What a worker gives, in its order."""


@dataclass(frozen=True)
class CheckClaim:
    """The right to run a sensitivity check, until its epoch is over.

    Attributes:
        id: of the check.
        epoch: of the lease.
        spec: what is checked.
    """

    id: str
    epoch: int
    spec: Checked = field(compare=False)
