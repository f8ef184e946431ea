"""What happens to experiments, one event after another.

Events are numbered from 1 without holes, in the order in which they came to be stored: whoever has seen a number has
seen, or can read, every smaller one. None tells anything of reality that is hidden.
"""

from enum import StrEnum
from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Moment


class EventKind(StrEnum):
    """What can happen. Those of a repetition have its number; those of a step have the iteration in their body."""

    SUBMITTED = "submitted"
    IMPORTED = "imported"
    STARTED = "started"
    PAUSING = "pausing"
    PAUSED = "paused"
    RESUMED = "resumed"
    STOPPING = "stopping"
    EXTENDED = "extended"
    COMPLETED = "completed"
    FAILED = "failed"
    CANCELLED = "cancelled"
    SENSITIVITY_ENDED = "sensitivity_ended"
    VERSIONS_REFUSED = "versions_refused"
    VERSIONS_ACCEPTED = "versions_accepted"
    REPETITION_CLAIMED = "repetition_claimed"
    REPETITION_COMPLETED = "repetition_completed"
    REPETITION_FAILED = "repetition_failed"
    REPETITION_LOST = "repetition_lost"
    REPETITION_HANDED_BACK = "repetition_handed_back"
    REPETITION_PAUSED = "repetition_paused"
    REPETITION_STOPPED = "repetition_stopped"
    REPETITION_CANCELLED = "repetition_cancelled"
    SELECTED = "selected"
    MEASURED = "measured"
    TUNED = "tuned"
    TRANSFERRED = "transferred"
    PROBED = "probed"


class EventRead(Frozen):
    """One thing that happened."""

    number: int = Field(description="of all events, from 1 and without holes; resume after it")
    kind: EventKind
    experiment: Id
    study: Id | None = None
    repetition: int | None = Field(default=None, description="its number; null where it is the experiment's")
    body: dict[str, Any] = Field(
        description="a few values that tell more: iteration, fitness, reason",
        examples=[{"iteration": 1, "fitness": 1.31}],
    )
    at: Moment


class EventPage(Frozen):
    """Some events, and where those that follow begin."""

    items: tuple[EventRead, ...]
    last: int = Field(description="pass it as `after` for what follows: every event up to it was looked at")
    latest: int = Field(description="number of the latest event there was")
