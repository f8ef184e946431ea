"""Dependencies of endpoints: the store, the caller, valid ids, and query parameters that several endpoints share."""

import asyncio
import logging
import re
from collections.abc import AsyncIterator
from contextlib import suppress
from dataclasses import replace
from typing import Annotated, Any, TypeVar

from fastapi import Depends, Header, Query, Request
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from gaplab.api.http.access import ASKING, READING
from gaplab.api.http.event_feed import EventFeed
from gaplab.api.http.limits import Streams
from gaplab.api.http.violations import wrong_parameters
from gaplab.schemas.access import Role
from gaplab.services.access import Caller, demand
from gaplab.services.core.errors import InvalidSpec, NotFound
from gaplab.services.experiments.limits import Admission
from gaplab.services.nesting import refuse_too_deep
from gaplab.services.replay.process import RolloutProcess
from gaplab.services.settings import Limits
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.session import Store

T = TypeVar("T")

WRITERS = 12
"""Requests that may write at once: with three waiting lines, they leave a thread of the service free."""

PATIENCE_S = 20.0
"""Longest wait of a request that may write for its place."""

logger = logging.getLogger(__name__)


IdempotencyKey = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        min_length=1,
        max_length=255,
        pattern=r"^[!-~]+$",
        description="text of your choice; a request repeated with the same key within a week is executed only once",
    ),
]


def _store(request: Request) -> Store:
    """Return the app's database after checking that it answers and has the schema of this version."""
    store: Store = request.app.state.store
    store.check()
    return store


def _plausible(text: str) -> str:
    """Return a text that can be an id; any other is not found, and never reaches the database."""
    if not re.fullmatch(r"[A-Za-z0-9_-]{1,64}", text):
        raise NotFound(f"there is nothing with the id {text[:64]!r}")
    return text


def _caller(request: Request) -> Caller:
    caller: Caller = request.state.caller
    return caller


def of_app(name: str) -> Any:  # noqa: ANN401 - a dependency has no type of its own
    """Return the dependency on what the app keeps under this name."""

    def kept(request: Request) -> object:
        return getattr(request.app.state, name)

    return Depends(kept)


def _limited(request: Request) -> Admission:
    return Admission(_caller(request).token, request.app.state.limits)


def _admission(admitted: Annotated[Admission, Depends(_limited)], key: IdempotencyKey = None) -> Admission:
    return replace(admitted, key=key)


StoreDep = Annotated[Store, Depends(_store)]
CallerDep = Annotated[Caller, Depends(_caller)]
LimitsDep = Annotated[Limits, of_app("limits")]
RolloutProcessDep = Annotated[RolloutProcess, of_app("rollout_process")]
FeedDep = Annotated[EventFeed, of_app("feed")]
StreamsDep = Annotated[Streams, of_app("streams")]
LimitedDep = Annotated[Admission, Depends(_limited)]
AdmissionDep = Annotated[Admission, Depends(_admission)]
Id = Annotated[str, AfterValidator(_plausible)]
Number = Annotated[int, Field(ge=0, le=1_000_000)]
"""The number of a repetition or an iteration, from 0."""

Asked = Annotated[T, Query()]
"""The query parameters of an operation, as a model."""


async def refuse_malformed(request: Request) -> None:
    """Refuse parameters that are repeated, or that the operation has not, and JSON that nests too deep.

    Raises:
        InvalidSpec: with every such parameter, or the first place that is too deep.
    """
    if wrong := wrong_parameters(request):
        raise InvalidSpec(wrong)
    if request.scope["route"].body_field is not None:
        with suppress(ValueError, RecursionError):  # it is refused as not being JSON
            refuse_too_deep(await request.json())


async def take_place(request: Request, _: Annotated[None, Depends(refuse_malformed)]) -> AsyncIterator[None]:
    """Let a few valid requests that may write in at once; others wait without a thread, and not for ever.

    Raises:
        StoreUnavailable: no place became free in time.
    """
    places = request.app.state.writers
    if request.method in READING or request.scope["path"] in ASKING:
        yield
        return
    try:
        async with asyncio.timeout(PATIENCE_S):
            await places.acquire()
    except TimeoutError as error:
        raise StoreUnavailable(f"other requests have been writing for {PATIENCE_S:g} s; try again soon") from error
    try:
        yield
    finally:
        places.release()


class Parameters(BaseModel):
    """Query parameters; an unknown one is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Paging(Parameters):
    """The part of a list to return."""

    limit: int = Field(50, ge=1, le=500, description="most items to return")
    cursor: str | None = Field(None, max_length=2_000, description="`next` of the previous part")


class Confirmation(Parameters):
    """Confirmation of a high cost, or of an unlikely name."""

    confirm_cost: bool = Field(
        False,
        description="confirm a cost above `GAPLAB_MAX_UNCONFIRMED_CORE_HOURS`, or a bench whose name is nearly that of "
        "another; without it, such a request is refused",
    )

    def given(self, admitted: Admission) -> Admission:
        """Return the admission with this confirmation."""
        return replace(admitted, cost_known=self.confirm_cost)


Confirming = Asked[Confirmation]


class Revealing(Parameters):
    """Whether to show reality's parameters before the experiment ends."""

    reveal: bool = Field(
        False, description="show reality's parameters before the experiment has ended; requires an admin's token"
    )

    def permitted(self, caller: Caller) -> bool:
        """Return `reveal`; raise Forbidden if the caller may not reveal reality."""
        if self.reveal:
            demand(caller, Role.ADMIN, "to reveal reality's parameters")
            logger.warning("reality is revealed to token %s", caller.token)
        return self.reveal
