"""What endpoints are given: the store, ids that can be ids, and the query parameters that several share."""

import re
from typing import Annotated

from fastapi import Depends, Request
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from services.core.errors import NotFound
from services.store.session import Store


def _store(request: Request) -> Store:
    """The app's database, once it is known to answer and to have the schema of this version."""
    store: Store = request.app.state.store
    store.check()
    return store


def _plausible(text: str) -> str:
    """An id as this service gives them; anything else cannot be found, and never reaches the database."""
    if not re.fullmatch(r"[A-Za-z0-9_-]{1,64}", text):
        msg = f"there is nothing with the id {text[:64]!r}"
        raise NotFound(msg)
    return text


StoreDep = Annotated[Store, Depends(_store)]
Id = Annotated[str, AfterValidator(_plausible)]


class Parameters(BaseModel):
    """Query parameters; a misspelt one is an error, not ignored."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Paging(Parameters):
    """Which part of a list."""

    limit: int = Field(default=50, ge=1, le=500, description="how many at most")
    cursor: str | None = Field(default=None, max_length=500, description="`next` of the part before")
