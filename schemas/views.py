"""Saved views: queries with a name, which all users of a service share."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, StringConstraints, model_validator

from gaplab.schemas.base import Examples, Frozen, Moment

Order = Literal["created_at", "-created_at", "name", "-name", "strategy", "-strategy", "state", "-state"]
"""An order of a list: a field, with a minus before it for the opposite order."""

OF_STUDIES: tuple[Order, ...] = ("created_at", "-created_at", "name", "-name")
"""Orders of studies; experiments have all."""

Shown = Literal["all", "studies", "experiments"]
"""What a view lists."""

ViewName = Annotated[
    str, StringConstraints(max_length=60, pattern=r"^[\w(][\w .:+()-]*$"), Field(examples=["slippery gaits"])
]
"""The name of a saved view: letters, digits, spaces and `_ . : + - ( )`."""


class ViewSpec(Frozen):
    """What a saved view shows."""

    EXAMPLES: ClassVar[Examples] = {
        "experiments": {
            "summary": "The best of a strategy",
            "value": {"shows": "experiments", "query": "strategy = informative and fitness > 0.5"},
        },
        "archived": {"summary": "The archived studies", "value": {"query": "archived = true", "sort": "name"}},
    }

    shows: Shown = Field(
        default="all", description="what the view lists; `all`: studies, and experiments without a study"
    )
    query: Annotated[str, Field(max_length=1_000)] | None = Field(
        default=None, description="query of the list; null: all", examples=["strategy = informative and fitness > 0.5"]
    )
    sort: Order = Field(default="-created_at", description="field to sort by; a minus reverses the order")

    @model_validator(mode="after")
    def _sorts_what_it_shows(self) -> "ViewSpec":
        if self.shows != "experiments" and self.sort not in OF_STUDIES:
            raise ValueError(f"studies cannot be sorted by {self.sort}; permitted: {', '.join(OF_STUDIES)}")
        return self


class ViewRead(ViewSpec):
    """A saved view."""

    name: ViewName
    created_at: Moment
