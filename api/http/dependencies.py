"""What endpoints are given: the store, ids that can be ids, and the query parameters that several share."""

import logging
import re
from dataclasses import replace
from typing import Annotated, TypeVar

from fastapi import Depends, Header, Request, Response
from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from starlette.datastructures import URLPath

from gaplab.api.http.violations import given_twice
from gaplab.schemas.access import Role
from gaplab.schemas.base import Frozen
from gaplab.services.access import Caller, demand
from gaplab.services.core.errors import InvalidSpec, NotFound
from gaplab.services.experiments.limits import Admission, Once
from gaplab.services.replay.process import RolloutProcess
from gaplab.services.store.session import Store

R = TypeVar("R", bound=Frozen)

logger = logging.getLogger(__name__)


IdempotencyKey = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        min_length=1,
        max_length=255,
        pattern=r"^[!-~]+$",
        description="any text of the sender's choice: the same request with the same key is done once, within a week",
    ),
]


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


def _caller(request: Request) -> Caller:
    """Who asks, as `gaplab.api.http.access` found out."""
    caller: Caller = request.state.caller
    return caller


def _rollout_process(request: Request) -> RolloutProcess:
    """The process of the app that computes what is asked for while somebody waits."""
    process: RolloutProcess = request.app.state.rollout_process
    return process


def _limited(request: Request) -> Admission:
    """Who submits, and within which limits."""
    return Admission(_caller(request).token, request.app.state.limits)


def _admission(admitted: Annotated[Admission, Depends(_limited)], key: IdempotencyKey = None) -> Admission:
    """The same, and under which key."""
    return replace(admitted, key=key)


StoreDep = Annotated[Store, Depends(_store)]
CallerDep = Annotated[Caller, Depends(_caller)]
RolloutProcessDep = Annotated[RolloutProcess, Depends(_rollout_process)]
LimitedDep = Annotated[Admission, Depends(_limited)]
AdmissionDep = Annotated[Admission, Depends(_admission)]
Id = Annotated[str, AfterValidator(_plausible)]


async def refuse_doubles(request: Request) -> None:
    """Of a query parameter that takes one value and is given several, none is chosen.

    Raises:
        InvalidSpec: there are such.
    """
    if doubles := given_twice(request):
        raise InvalidSpec(doubles)


class Parameters(BaseModel):
    """Query parameters; a misspelt one is an error, not ignored, and so is one that is given twice."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Paging(Parameters):
    """Which part of a list."""

    limit: int = Field(default=50, ge=1, le=500, description="how many at most")
    cursor: str | None = Field(default=None, max_length=2_000, description="`next` of the part before")


class Revealing(Parameters):
    """Whether reality's parameters are shown before the end."""

    reveal: bool = Field(default=False, description="show reality's parameters already; wants an admin's token")

    def permitted(self, caller: Caller) -> bool:
        """What was asked for.

        Raises:
            Forbidden: it is more than the caller may see.
        """
        if self.reveal:
            demand(caller, Role.ADMIN, "to reveal reality's parameters")
            logger.warning("reality is revealed to token %s", caller.token)
        return self.reveal


def created(once: Once[R], response: Response, location: URLPath) -> R:
    """The answer to what was submitted, with where it is, and whether it was submitted before."""
    response.headers["Location"] = str(location)
    if once.replayed:
        response.headers["Idempotent-Replayed"] = "true"
    return once.answer
