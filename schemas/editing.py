"""What people may change about a study or an experiment after it was submitted."""

from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from gaplab.schemas.base import Examples, Frozen, Label


class Edit(Frozen):
    """A new name, new notes, or both; what is left out stays."""

    EXAMPLES: ClassVar[Examples] = {
        "another name": {"summary": "Rename it", "value": {"name": "half the weight"}},
        "notes": {"summary": "Tell others about it", "value": {"notes": "stopped early: the bounds were wrong"}},
    }

    name: Label | None = Field(default=None, description="a new name")
    notes: Annotated[str, Field(max_length=10_000)] | None = Field(
        default=None, description="new notes; null takes them away"
    )

    @model_validator(mode="after")
    def _something_changes(self) -> "Edit":
        if not self.model_fields_set:
            msg = "give a name, notes, or both"
            raise ValueError(msg)
        if "name" in self.model_fields_set and self.name is None:
            msg = "a name can be changed, not taken away"
            raise ValueError(msg)
        return self
