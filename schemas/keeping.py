"""What keeping returns: rendered notes, and what was deleted."""

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Moment, Name


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
