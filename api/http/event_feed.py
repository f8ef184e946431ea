"""The one reader of events in this process, for all streams together."""

import asyncio
import logging
from collections import deque
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager

from anyio.to_thread import run_sync

from gaplab.schemas.events import EventPage, EventRead
from gaplab.services import events
from gaplab.services.core.errors import StoreUnavailable
from gaplab.services.events import WantedEvents
from gaplab.services.store.session import Store

EVERY_S = 0.25
"""Between looks at the database, as long as there is a stream."""

RETRY_S = 1.0
"""Before the next look at a database that cannot be used now."""

PAGE = 500
KEPT = 2_000
"""Latest events, from which streams are served; one that is further behind reads pages of its own until it is not."""

log = logging.getLogger("gaplab.api")


class Feed:
    """Events as they are stored, to any number of streams, at one query a look; without a stream nothing is read.

    It lives in one event loop, and holds no transaction while it waits.
    """

    def __init__(self, store: Store, *, every_s: float = EVERY_S, kept: int = KEPT) -> None:
        self._store = store
        self._every_s = every_s
        self._recent: deque[EventRead] = deque(maxlen=kept)
        self._head: int | None = None
        self._news = asyncio.Event()
        self._reader: asyncio.Task[None] | None = None
        self._open = 0
        self._closed = False

    @property
    def open(self) -> int:
        """How many streams there are now."""
        return self._open

    async def follow(self, after: int, which: WantedEvents) -> AsyncIterator[EventRead]:
        """These events, in order and each once, from the first after that number; until the feed is closed."""
        with self._counted():
            while not (self._closed or self._reader is None or self._reader.done()):
                news, found = self._news, self._after(after)
                if found is None:
                    page = await self._page(after, which)
                    found, after = page.items, max(after, page.last)
                elif found:
                    after = found[-1].number
                else:
                    await news.wait()
                for each in found:
                    if which.has(each):
                        yield each

    def close(self) -> None:
        """End every stream, and any that is opened from now on: the service stops."""
        self._closed = True
        self._news.set()

    @contextmanager
    def _counted(self) -> Iterator[None]:
        self._open += 1
        if not self._closed and (self._reader is None or self._reader.done()):
            self._reader = asyncio.get_running_loop().create_task(self._read())
            self._reader.add_done_callback(self._give_up)
        try:
            yield
        finally:
            self._open -= 1
            if not self._open and self._reader is not None:
                self._reader.cancel()
                self._reader, self._head, self._news = None, None, asyncio.Event()
                self._recent.clear()

    def _after(self, number: int) -> tuple[EventRead, ...] | None:
        """The latest events after that number; None if some of them are not among those that are kept."""
        if self._head is None or number >= self._head:
            return ()
        if not self._recent or number < self._recent[0].number - 1:
            return None
        return tuple(each for each in self._recent if each.number > number)

    async def _page(self, after: int, which: WantedEvents) -> EventPage:
        """What follows for one stream that is behind; nothing new while the database cannot be used."""
        try:
            return await run_sync(lambda: events.page(self._store, after, which, limit=PAGE))
        except StoreUnavailable:
            await asyncio.sleep(RETRY_S)
            return EventPage(items=(), last=after, latest=after)

    async def _read(self) -> None:
        while not self._closed:
            try:
                await self._look()
                await asyncio.sleep(self._every_s)
            except StoreUnavailable as error:
                log.warning("event streams wait: %s", error)
                await asyncio.sleep(RETRY_S)

    def _give_up(self, reader: "asyncio.Task[None]") -> None:
        """A reader that failed ends all streams that wait: whoever resumes his gets a new one."""
        if not reader.cancelled() and (error := reader.exception()) is not None:
            log.error("event streams end: their reader failed", exc_info=error)
            self._tell()

    async def _look(self) -> None:
        if self._head is None:
            self._head = await run_sync(lambda: events.latest(self._store))
            self._tell()
        head = self._head
        page = await run_sync(lambda: events.page(self._store, head, WantedEvents(), limit=PAGE))
        if page.items:
            self._recent.extend(page.items)
            self._head = page.items[-1].number
            self._tell()

    def _tell(self) -> None:
        """Wake whoever waits, once."""
        told, self._news = self._news, asyncio.Event()
        told.set()
