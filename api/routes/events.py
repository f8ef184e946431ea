"""Events: what happens to experiments, as it happens or page by page."""

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import suppress
from typing import Annotated

from anyio.to_thread import run_sync
from fastapi import APIRouter, Depends, Header, Query, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import Field

from gaplab.api.http import event_examples, examples
from gaplab.api.http.dependencies import CallerDep, Id, Parameters, StoreDep
from gaplab.api.http.event_feed import Feed
from gaplab.api.http.limits import Streams
from gaplab.api.http.problems import documented
from gaplab.schemas.events import EventKind, EventPage
from gaplab.services import events
from gaplab.services.events import WantedEvents

router = APIRouter(prefix="/events", tags=["events"])

After = Annotated[int, Field(ge=0, lt=2**53, description="number of the last event that is known; 0: none")]


class EventFilter(Parameters):
    """Which events."""

    experiment: Id | None = Field(default=None, description="only of this experiment")
    study: Id | None = Field(default=None, description="only of this study's experiments")
    kind: list[EventKind] = Field(default=[], max_length=50, description="only of these kinds; repeat it for several")
    after: After = 0

    def which(self) -> WantedEvents:
        """The same, as the service has it."""
        return WantedEvents(experiment=self.experiment, study=self.study, kinds=frozenset(self.kind))


class EventPaging(EventFilter):
    """Which events, and how many at once."""

    limit: int = Field(default=100, ge=1, le=1_000, description="how many at most")
    wait_s: float = Field(default=0.0, ge=0.0, le=60.0, description="how long to wait for the first, if there is none")


def _feed(request: Request) -> Feed:
    feed: Feed = request.app.state.feed
    return feed


def _streams(request: Request) -> Streams:
    streams: Streams = request.app.state.streams
    return streams


StreamsDep = Annotated[Streams, Depends(_streams)]


def _room(streams: StreamsDep, caller: CallerDep) -> Iterator[None]:
    """Room for one more stream, for as long as it is open."""
    with streams.open(caller.token):
        yield


def _found(store: StoreDep, asked: Annotated[EventFilter, Query()]) -> WantedEvents:
    """Before a stream begins, for later no problem can be answered any more."""
    events.check(store, asked.which())
    return asked.which()


@router.get(
    "",
    response_class=EventSourceResponse,
    summary="Stream events",
    responses={
        200: {
            "description": "Server-sent events: the number is the `id`, the kind the `event`, all of it the `data`",
            "content": {"text/event-stream": {"schema": {"type": "string"}, "example": event_examples.STREAM}},
        },
        **documented(404, 422, 429),
    },
    dependencies=[Depends(_room)],
)
async def stream_events(
    asked: Annotated[EventFilter, Query()],
    which: Annotated[WantedEvents, Depends(_found)],
    feed: Annotated[Feed, Depends(_feed)],
    last_event_id: Annotated[After | None, Header(description="as `after`, and above it")] = None,
) -> AsyncIterator[ServerSentEvent]:
    """Every event after `Last-Event-ID` or `after`, and from then on each as it happens; a comment every 15 s between.

    Numbers have no holes, so that a stream which is resumed after the last number it had misses nothing. With a filter,
    what is left out are other experiments' numbers. `GET /events/page` has the same for whoever can't hold a stream.
    """
    after = asked.after if last_event_id is None else last_event_id
    async for each in feed.follow(after, which):
        yield ServerSentEvent(raw_data=each.model_dump_json(), event=each.kind.value, id=str(each.number))


@router.get(
    "/page",
    summary="List events",
    responses={200: examples.shown(event_examples.EVENTS, "In their order"), **documented(404, 422, 429)},
)
async def list_events(
    store: StoreDep,
    asked: Annotated[EventPaging, Query()],
    feed: Annotated[Feed, Depends(_feed)],
    streams: StreamsDep,
    caller: CallerDep,
) -> EventPage:
    """Events after a number, in their order; pass `last` as `after` for what follows, with `wait_s` to wait for it.

    Who waits has a stream open until he is answered.
    """
    which = asked.which()
    await run_sync(lambda: events.check(store, which))
    found = await run_sync(lambda: events.page(store, asked.after, which, limit=asked.limit))
    if found.items or not asked.wait_s:
        return found
    with streams.open(caller.token), suppress(TimeoutError):
        async with asyncio.timeout(asked.wait_s):
            async for _ in feed.follow(found.last, which):
                break
    return await run_sync(lambda: events.page(store, found.last, which, limit=asked.limit))
