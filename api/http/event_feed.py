"""The one reader of events in a process, for all streams together."""

import asyncio
import logging
from collections import deque
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager, suppress

from anyio.to_thread import run_sync

from gaplab.schemas.events import EventPage, EventRead
from gaplab.services import events
from gaplab.services.events import WantedEvents
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.session import Store

POLL_S = 0.25
"""Interval between queries while a stream is open."""

RETRY_S = 1.0
"""Interval between queries while the database does not answer."""

PAGE = 500
KEPT = 2_000
"""Latest events in memory; a stream that is further behind reads pages from the database until it has caught up."""

log = logging.getLogger("gaplab.api")


class EventFeed:
    """Newly stored events for any number of streams, from one query per interval; without streams it reads nothing.

    It lives in one event loop, and holds no transaction while it waits.
    """

    def __init__(self, store: Store, *, every_s: float = POLL_S, kept: int = KEPT) -> None:
        self._store = store
        self._every_s = every_s
        self._recent: deque[EventRead] = deque(maxlen=kept)
        self._head: int | None = None
        self._databases = 0
        self._news = asyncio.Event()
        self._reader: asyncio.Task[None] | None = None
        self._open = 0
        self._closed = False

    @property
    def open(self) -> int:
        """The number of open streams."""
        return self._open

    async def follow(self, after: int, which: WantedEvents) -> AsyncIterator[EventRead]:
        """Yield the selected events after that number, in order and each once, until the feed is closed.

        It also ends if the database was replaced by one with fewer events: numbers then have another meaning.
        """
        with self._counted():
            databases = self._databases
            while not (self._closed or self._reader is None or self._reader.done() or self._databases > databases):
                news, recent = self._news, self._after(after)
                if recent is None:
                    page = await self._page(after, which)
                    recent, after = page.items, max(after, page.last)
                elif recent:
                    after = recent[-1].number
                else:
                    await news.wait()
                for event in recent:
                    if which.has(event):
                        yield event

    async def news(self, after: int, which: WantedEvents, wait_s: float) -> bool:
        """Wait for a selected event after that number, and return whether there is one in time."""
        with suppress(TimeoutError):
            async with asyncio.timeout(wait_s):
                async for _ in self.follow(after, which):
                    return True
        return False

    def close(self) -> None:
        """End all streams, and refuse later ones."""
        self._closed = True
        self._news.set()

    @contextmanager
    def _counted(self) -> Iterator[None]:
        """Count an open stream; the first starts the reader, the last ends it."""
        self._open += 1
        if not self._closed and (self._reader is None or self._reader.done()):
            self._reader = asyncio.get_running_loop().create_task(self._read())
            self._reader.add_done_callback(self._end_streams)
        try:
            yield
        finally:
            self._open -= 1
            if not self._open and self._reader is not None:
                self._reader.cancel()
                self._reader, self._head, self._news = None, None, asyncio.Event()
                self._recent.clear()

    def _after(self, number: int) -> tuple[EventRead, ...] | None:
        """Return the events after that number; None if some of them are no longer in memory."""
        if self._head is None or number >= self._head:
            return ()
        if not self._recent or number < self._recent[0].number - 1:
            return None
        return tuple(event for event in self._recent if event.number > number)

    async def _page(self, after: int, which: WantedEvents) -> EventPage:
        """Return the next events for a stream that is behind; none while the database does not answer."""
        try:
            return await run_sync(lambda: events.page(self._store, after, which, limit=PAGE))
        except StoreUnavailable:
            await asyncio.sleep(RETRY_S)
            return EventPage(items=(), last=after, latest=after)

    async def _read(self) -> None:
        while not self._closed:
            try:
                await self._read_once()
                await asyncio.sleep(self._every_s)
            except StoreUnavailable as error:
                log.warning("event streams wait for the database: %s", error)
                await asyncio.sleep(RETRY_S)

    def _end_streams(self, reader: "asyncio.Task[None]") -> None:
        """End all waiting streams if the reader failed; a client that resumes its stream starts a new reader."""
        if not reader.cancelled() and (error := reader.exception()) is not None:
            log.error("event streams end: their reader failed", exc_info=error)
            self._wake()

    async def _read_once(self) -> None:
        """Read what is new, and wake the streams; if the database has fewer events than before, they end."""
        if self._head is None:
            self._head = await run_sync(lambda: events.latest(self._store))
            self._wake()
        head = self._head
        page = await run_sync(lambda: events.page(self._store, head, WantedEvents(), limit=PAGE))
        if page.latest < head:
            log.warning("event streams end: the database has fewer events than before, so it was replaced or restored")
            self._databases += 1
            self._head = None
            self._recent.clear()
            self._wake()
        elif page.items:
            self._recent.extend(page.items)
            self._head = page.items[-1].number
            self._wake()

    def _wake(self) -> None:
        news, self._news = self._news, asyncio.Event()
        news.set()
