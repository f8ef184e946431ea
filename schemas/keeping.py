"""What a service keeps beside results: tokens, changes and notes, notifications of ended studies, and saved views."""

from datetime import datetime
from enum import StrEnum
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field, StringConstraints, model_validator

from gaplab.schemas.base import Examples, Frozen, Id, Label, Moment, Name, Tag
from gaplab.schemas.lifecycle import State


class Role(StrEnum):
    """What a token permits; each role includes the roles before it."""

    READER = "reader"
    """May read everything that is not hidden."""

    RUNNER = "runner"
    """May also submit, edit and control experiments."""

    ADMIN = "admin"
    """May also see the hidden reality of an experiment that has not ended."""

    def permits(self, other: "Role") -> bool:
        """Return whether this role includes the other."""
        order = tuple(Role)
        return order.index(self) >= order.index(other)


class TokenRead(Frozen):
    """A listed token, without its secret."""

    id: str
    name: str
    role: Role
    created_at: datetime
    last_used_at: datetime | None = None
    revoked_at: datetime | None = None


MOST_TAGS = 20
"""Tags of one study."""

Tags = Annotated[tuple[Tag, ...], Field(max_length=MOST_TAGS), AfterValidator(lambda tags: tuple(sorted(set(tags))))]
"""Tags in alphabetical order, each once."""


class Edit(Frozen):
    """A new name, new notes or other tags; a missing field stays unchanged."""

    EXAMPLES: ClassVar[Examples] = {
        "another name": {"summary": "Rename it", "value": {"name": "half the weight"}},
        "notes": {"summary": "Tell others about it", "value": {"notes": "stopped early: the bounds were wrong"}},
        "tags": {"summary": "Tag it", "value": {"add_tags": ["gait", "paper"], "remove_tags": ["draft"]}},
    }

    name: Label | None = Field(default=None, description="a new name")
    notes: Annotated[str, Field(max_length=10_000)] | None = Field(
        default=None, description="new notes in Markdown; null removes them"
    )
    tags: Tags | None = Field(default=None, description="all of its tags; an empty list removes them")
    add_tags: Tags = Field(default=(), description="tags to add to those it has")
    remove_tags: Tags = Field(default=(), description="tags to remove from those it has")

    @model_validator(mode="after")
    def _something_changes(self) -> "Edit":
        if not self.model_fields_set:
            raise ValueError("nothing to change: give a name or notes, or tags to add or remove")
        if "name" in self.model_fields_set and self.name is None:
            raise ValueError("the name is null, but must be text: a name can be changed, not removed")
        if "tags" in self.model_fields_set and self.tags is None:
            raise ValueError("the tags are null, but must be a list: an empty one removes them")
        if "tags" in self.model_fields_set and (self.add_tags or self.remove_tags):
            raise ValueError("give either all tags, or tags to add and to remove")
        return self


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
    study: Id | None = Field(default=None, description="study of a deleted experiment; null: a study of several")
    deleted_at: Moment


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
    url: str | None = Field(default=None, description="address on the page")


class WebhookSpec(Frozen):
    """An address to tell when a study has ended."""

    EXAMPLES: ClassVar[Examples] = {
        "a chat": {"summary": "Post into a chat", "value": {"url": "https://hooks.example.org/services/T0/B0/x"}}
    }

    url: Annotated[str, Field(min_length=1, max_length=1_000, pattern=r"^[!-~]+$")] = Field(
        description="address that gets a POST; its host must be one that the owner of the service permits"
    )


class WebhookRead(Frozen):
    """The webhook of a study, without the rest of its address, which may be a secret."""

    host: str | None = Field(description="host that is told; null: none", examples=["hooks.example.org"])


Order = Literal["created_at", "-created_at", "name", "-name"]
"""An order of a list: a field, with a minus before it for the opposite order."""

ViewName = Annotated[
    str, StringConstraints(max_length=60, pattern=r"^[\w(][\w .:+()-]*$"), Field(examples=["slippery gaits"])
]
"""The name of a saved view: letters, digits, spaces and `_ . : + - ( )`."""


class ViewSpec(Frozen):
    """What a saved view shows."""

    EXAMPLES: ClassVar[Examples] = {
        "good": {
            "summary": "The best of a strategy",
            "value": {"query": "strategy = informative and fitness > 0.5"},
        },
        "archived": {"summary": "The archived studies", "value": {"query": "archived = true", "sort": "name"}},
    }

    query: Annotated[str, Field(max_length=1_000)] | None = Field(
        default=None, description="query of the list; null: all", examples=["strategy = informative and fitness > 0.5"]
    )
    sort: Order = Field(default="-created_at", description="field to sort by; a minus reverses the order")


class ViewRead(ViewSpec):
    """A saved view."""

    name: ViewName
    created_at: Moment
