"""Notifications of studies that have ended."""

from enum import StrEnum
from typing import Annotated, ClassVar

from pydantic import Field

from gaplab.schemas.base import Examples, Frozen, Id, Moment, Name, Read
from gaplab.schemas.lifecycle import State


class Channel(StrEnum):
    """Where notifications go."""

    WEBHOOK = "webhook"
    """The webhook of the service: `GAPLAB_NOTIFY_URL`."""

    COMMAND = "command"
    """The command of the service: `GAPLAB_NOTIFY_COMMAND`."""

    OWN = "own_webhook"
    """The webhook of one study."""


class EndedExperiment(Frozen):
    """An experiment of a notification."""

    id: Id
    name: Name
    state: State


class Notification(Frozen):
    """What a webhook gets as its body, and a command on its standard input. It may arrive more than once."""

    id: str = Field(description="the same at each attempt: ignore a message whose id you know", examples=["412-01f2e3"])
    subject: Id = Field(description="id of the study")
    name: Name
    state: State
    text: str = Field(
        description="one sentence, which Slack and Mattermost show", examples=["The study x is COMPLETED."]
    )
    experiments: tuple[EndedExperiment, ...]
    ended_at: Moment
    url: str | None = Field(None, description="address on the page")


class WebhookSpec(Frozen):
    """An address to tell when a study has ended."""

    EXAMPLES: ClassVar[Examples] = {
        "a chat": {"summary": "Post into a chat", "value": {"url": "https://hooks.example.org/services/T0/B0/x"}}
    }

    url: Annotated[str, Field(min_length=1, max_length=1_000, pattern=r"^[!-~]+$")] = Field(
        description="address that gets a POST; its host must be one that the owner of the service permits"
    )


class WebhookRead(Read):
    """The webhook of a study, without the rest of its address, which may be a secret."""

    host: str | None = Field(description="host that is told; null: none", examples=["hooks.example.org"])
