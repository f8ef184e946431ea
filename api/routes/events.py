"""Events: what happens to experiments, as a stream or page by page."""

from collections.abc import AsyncIterator
from typing import Annotated

from anyio.to_thread import run_sync
from fastapi import APIRouter, Depends, Header
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import Field

from gaplab.api.http.dependencies import Asked, CallerDep, FeedDep, Id, Parameters, StoreDep, StreamsDep
from gaplab.api.http.documentation import sent
from gaplab.api.http.problems import documented
from gaplab.schemas.events import EventKind, EventPage
from gaplab.services import events
from gaplab.services.events import WantedEvents

router = APIRouter(prefix="/events", tags=["events"])

After = Annotated[int, Field(ge=0, lt=2**53, description="number of the last event that the client knows; 0: none")]

_EXAMPLE = (
    'event: probed\ndata: {"number":412,"kind":"probed","experiment":"01f2e3d4c5b6","repetition":3,…}\nid: 412\n\n'
)


class EventFilter(Parameters):
    """The events to return."""

    study: Id | None = Field(None, description="only events of this study, or of this experiment")
    kind: list[EventKind] = Field([], max_length=50, description="only events of these kinds; repeat for more")
    after: After = 0

    def which(self) -> WantedEvents:
        """Return the selection of events for the service."""
        return WantedEvents(study=self.study, kinds=frozenset(self.kind))


class EventPaging(EventFilter):
    """The events to return, how many, and how long to wait for the first."""

    limit: int = Field(100, ge=1, le=1_000, description="most events to return")
    wait_s: float = Field(0.0, ge=0.0, le=60.0, description="seconds to wait for an event if there is none")


async def _count_stream(streams: StreamsDep, caller: CallerDep) -> AsyncIterator[None]:
    """Count one more open stream until the response ends."""
    with streams.open(caller.token):
        yield


def _after(
    store: StoreDep,
    query: Asked[EventFilter],
    last_event_id: Annotated[After | None, Header(description="like `after`, which it overrides")] = None,
) -> int:
    """Return the number to stream after; check the query before the stream begins, while a problem can be answered."""
    after = query.after if last_event_id is None else last_event_id
    events.check(store, query.which(), after)
    return after


@router.get(
    "",
    response_class=EventSourceResponse,
    summary="Stream events",
    response_description="Server-sent events: `id` is the number, `event` the kind, `data` the whole event",
    responses=sent({"text/event-stream": _EXAMPLE}) | documented(409, 429),
    dependencies=[Depends(_count_stream)],
)
async def stream_events(
    query: Asked[EventFilter], after: Annotated[int, Depends(_after)], feed: FeedDep
) -> AsyncIterator[ServerSentEvent]:
    """Stream every event after `Last-Event-ID` or `after`, then each new one; a comment keeps the stream open.

    Event numbers have no gaps, so a stream that resumes after its last number misses nothing. A filter skips the
    numbers of other events. A number beyond the latest is answered with 409: the database was replaced. Clients that
    cannot hold a stream open use `GET /events/page`.
    """
    async for event in feed.follow(after, query.which()):
        yield ServerSentEvent(raw_data=event.model_dump_json(), event=event.kind.value, id=str(event.number))


@router.get("/page", summary="List events", response_description="By number", responses=documented(409, 429))
async def list_events(
    store: StoreDep, query: Asked[EventPaging], feed: FeedDep, streams: StreamsDep, caller: CallerDep
) -> EventPage:
    """List events after a number; pass `last` as `after` for the next page, with `wait_s` to wait for it.

    A waiting request counts as an open stream.
    """
    which = query.which()
    await run_sync(lambda: events.check(store, which, query.after))
    page = await run_sync(lambda: events.page(store, query.after, which, limit=query.limit))
    if page.items or not query.wait_s:
        return page
    with streams.open(caller.token):
        await feed.news(page.last, which, query.wait_s)
    return await run_sync(lambda: events.page(store, page.last, which, limit=query.limit))
