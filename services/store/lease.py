"""Leases of repetitions and sensitivity checks, and the deliveries of a repetition's holder."""

from dataclasses import dataclass, field
from typing import Any, TypeAlias

from gaplab.schemas.records import MeasurementKind
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.sensitivity import Checked
from gaplab.services.core.arrays import Genome
from gaplab.services.core.types import Step


@dataclass(frozen=True)
class Checkpoint:
    """Some of the simulators' answers in the current step, so that they need not be simulated again.

    Attributes:
        step: place of the step in the log.
        part: number of the checkpoint within the step, from 0.
        answers: packed by `gaplab.services.core.answers`, after `seconds` of work.
        rollouts, budget: rollouts of the step so far, and those that it was given.
    """

    step: int
    part: int
    answers: bytes
    seconds: float
    rollouts: int = 0
    budget: int = 0


@dataclass(frozen=True)
class Lease:
    """The right of one supervisor to a piece of work; a write with an old epoch or another owner is refused.

    Attributes:
        id: id of the work.
        epoch: number of the lease among the leases of this work, from 1.
        owner: the supervisor. Its name is unique, so a lease never fits work of the same id in another database.
    """

    id: int | str
    epoch: int
    owner: str = field(default="", kw_only=True, compare=False)


@dataclass(frozen=True)
class Claim(Lease):
    """The lease of a repetition; claims with the same epoch are equal.

    Attributes:
        number: number of the repetition within its experiment, from 0.
        log: recorded steps, after which to continue.
        checkpoints: checkpoints of the next step, if an earlier lease began it.
    """

    id: int
    experiment_id: str
    number: int
    spec: ResolvedSpec = field(compare=False)
    log: tuple[Step, ...] = field(default=(), compare=False)
    checkpoints: tuple[Checkpoint, ...] = field(default=(), compare=False)


@dataclass(frozen=True)
class CheckClaim(Lease):
    """The lease of a sensitivity check, with its subject."""

    id: str
    spec: Checked = field(compare=False)


@dataclass(frozen=True)
class TimedStep:
    """A step, and the seconds of work that it took."""

    step: Step
    seconds: float


@dataclass(frozen=True)
class Pulse:
    """A heartbeat of a worker, while it has nothing else to deliver.

    Attributes:
        step: place of the running step in the log.
        measuring: whether reality is being asked.
        idle_s: seconds since a rollout or a step ended.
        step_s: seconds of work in this step so far.
    """

    step: int
    measuring: bool
    idle_s: float
    step_s: float


@dataclass(frozen=True)
class Failure:
    """The reason why a worker cannot continue a repetition.

    Attributes:
        reason: text that everybody may see at any time.
        hidden: the reason with the message of reality's code, which may name hidden parameters.
        of_reality: whether the code of reality raised it.
    """

    reason: str
    hidden: str | None = None
    of_reality: bool = False


@dataclass(frozen=True, eq=False)
class Requested:
    """A measurement that only the physical world can give; the log goes on with its answer.

    Attributes:
        place: place of the measurement's step in the log.
        genome: `(g,)`: the controller to run.
        safety: what the latest tuned simulators expect of it, as JSON; None if nothing was asked.
    """

    place: int
    iteration: int
    kind: MeasurementKind
    genome: Genome
    safety: dict[str, Any] | None = None


Delivered: TypeAlias = TimedStep | Checkpoint | Requested
"""A delivery of a worker, to be stored."""
