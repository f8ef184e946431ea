"""Changes to a submitted study or experiment."""

from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from gaplab.schemas.base import Examples, Frozen, Label


class Edit(Frozen):
    """A new name, new notes, or both; a missing field stays unchanged."""

    EXAMPLES: ClassVar[Examples] = {
        "another name": {"summary": "Rename it", "value": {"name": "half the weight"}},
        "notes": {"summary": "Tell others about it", "value": {"notes": "stopped early: the bounds were wrong"}},
    }

    name: Label | None = Field(default=None, description="a new name")
    notes: Annotated[str, Field(max_length=10_000)] | None = Field(
        default=None, description="new notes; null removes them"
    )

    @model_validator(mode="after")
    def _something_changes(self) -> "Edit":
        if not self.model_fields_set:
            raise ValueError("nothing to change: give a name, notes, or both")
        if "name" in self.model_fields_set and self.name is None:
            raise ValueError("the name is null, but must be text: a name can be changed, not removed")
        return self
