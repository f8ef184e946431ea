"""What people do with studies: edits, notes, deletion, and saved views: queries with a name that all users share."""

from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field, StringConstraints, model_validator

from gaplab.schemas.base import Examples, Frozen, Id, Label, Moment, Name, Read, Tag

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

    name: Label | None = Field(None, description="a new name")
    notes: Annotated[str, Field(max_length=10_000)] | None = Field(
        None, description="new notes in Markdown; null removes them"
    )
    tags: Tags | None = Field(None, description="all of its tags; an empty list removes them")
    add_tags: Tags = Field((), description="tags to add to those it has")
    remove_tags: Tags = Field((), description="tags to remove from those it has")

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


class NotesRead(Read):
    """Notes as HTML."""

    html: str = Field(
        description="the notes, rendered: without scripts, images or HTML of their own",
        examples=["<p>the bounds were <em>too wide</em></p>"],
    )


class DeletionRead(Read):
    """A deleted study or experiment."""

    id: Id
    name: Name
    study: Id | None = Field(None, description="study of a deleted experiment; null: a study of several")
    deleted_at: Moment


Order = Literal["created_at", "-created_at", "name", "-name", "state", "-state", "fitness", "-fitness"]
"""An order of a list: a field, with a minus before it for the opposite order."""

ViewName = Annotated[
    str, StringConstraints(max_length=60, pattern=r"^[\w(][\w .:+()-]*$"), Field(examples=["slippery gaits"])
]
"""The name of a saved view: letters, digits, spaces and `_ . : + - ( )`."""


class ViewSpec(Read):
    """What a saved view shows."""

    EXAMPLES: ClassVar[Examples] = {
        "good": {"summary": "The best of a strategy", "value": {"query": "strategy = informative and fitness > 0.5"}},
        "archived": {"summary": "The archived studies", "value": {"query": "archived = true", "sort": "name"}},
    }

    query: Annotated[str, Field(max_length=1_000)] | None = Field(
        None, description="query of the list; null: all", examples=["strategy = informative and fitness > 0.5"]
    )
    sort: Order = Field("-created_at", description="field to sort by; a minus reverses the order")


class ViewRead(ViewSpec):
    """A saved view."""

    name: ViewName
    created_at: Moment
