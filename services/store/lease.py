"""A repetition, or a sensitivity check, in the hands of one supervisor."""

from dataclasses import dataclass, field

from schemas.sensitivity import Checked
from schemas.spec import ExperimentSpec
from services.core.types import Step


@dataclass(frozen=True)
class Claim:
    """The right to go on with a repetition, until its epoch is over; equal to another of the same epoch.

    Attributes:
        repetition_id: in the store.
        epoch: of the lease; a write that carries an old one is refused.
        experiment_id: whose repetition it is.
        number: of the repetition within its experiment, from 0.
        spec: resolved.
        log: the steps recorded so far, from which to go on.
    """

    repetition_id: int
    epoch: int
    experiment_id: str
    number: int
    spec: ExperimentSpec = field(compare=False)
    log: tuple[Step, ...] = field(default=(), compare=False)


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
