"""Events: the changes of experiments.

Events are numbered from 1 without gaps, in commit order: when a number is visible, all smaller ones are. No event
reveals anything hidden about reality.
"""

from enum import StrEnum
from typing import Any

from pydantic import Field

from gaplab.schemas.base import Id, Moment, Read


class EventKind(StrEnum):
    """Kinds of events.

    Events of a repetition have its number; events of a step have the iteration in their body.
    """

    SUBMITTED = "submitted"
    IMPORTED = "imported"
    STARTED = "started"
    WAITING = "waiting"
    PAUSING = "pausing"
    PAUSED = "paused"
    RESUMED = "resumed"
    STOPPING = "stopping"
    EXTENDED = "extended"
    RETRIED = "retried"
    COMPLETED = "completed"
    FAILED = "failed"
    CANCELLED = "cancelled"
    EDITED = "edited"
    ARCHIVED = "archived"
    UNARCHIVED = "unarchived"
    DELETED = "deleted"
    NOTIFIED = "notified"
    NOTIFICATION_FAILED = "notification_failed"
    SENSITIVITY_ENDED = "sensitivity_ended"
    VERSIONS_REFUSED = "versions_refused"
    VERSIONS_ACCEPTED = "versions_accepted"
    REPETITION_CLAIMED = "repetition_claimed"
    REPETITION_COMPLETED = "repetition_completed"
    REPETITION_FAILED = "repetition_failed"
    REPETITION_LOST = "repetition_lost"
    REPETITION_HANDED_BACK = "repetition_handed_back"
    REPETITION_WAITS = "repetition_waits"
    REPETITION_PAUSED = "repetition_paused"
    REPETITION_STOPPED = "repetition_stopped"
    REPETITION_CANCELLED = "repetition_cancelled"
    REQUESTED = "requested"
    REFUSED = "refused"
    TAKEN = "taken"
    RELEASED = "released"
    TAKE_EXPIRED = "take_expired"
    CONFLICTING = "conflicting"
    CORRECTED = "corrected"
    VOIDED = "voided"
    DECIDED = "decided"
    SELECTED = "selected"
    MEASURED = "measured"
    TUNED = "tuned"
    TRANSFERRED = "transferred"
    PROBED = "probed"


class EventRead(Read):
    """A change of an experiment, with its number."""

    number: int = Field(description="number of the event, from 1 without gaps; a reader resumes after it")
    kind: EventKind
    experiment: Id
    study: Id | None = Field(None, description="id of its study")
    repetition: int | None = Field(None, description="number of the repetition; null for an event of the experiment")
    body: dict[str, Any] = Field(
        description="details, such as iteration, fitness or reason", examples=[{"iteration": 1, "fitness": 1.31}]
    )
    at: Moment
    sentence: str = Field("", examples=["Repetition 0, iteration 1: measured in reality, 1.31"])


class EventPage(Read):
    """Some events, and the number to continue after."""

    items: tuple[EventRead, ...]
    last: int = Field(description="pass it as `after` to continue: events up to this number were searched")
    latest: int = Field(description="number of the latest event")
