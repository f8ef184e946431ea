"""Saved views: queries with a name, which all users of a service share."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, StringConstraints

from gaplab.schemas.base import Examples, Frozen, Moment

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
