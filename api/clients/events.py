"""Events of experiments: one iterator, even if the connection breaks."""

import time
from collections.abc import Iterator

from gaplab.api.clients.connection import Connected, Parameter, Plain, plain
from gaplab.api.clients.errors import ServiceError, ServiceUnreachable, is_final
from gaplab.schemas.events import EventPage, EventRead

RETRY_S = 1.0
"""Pause before a broken stream is opened again."""

SILENCE_S = 45.0
"""Longest silence of a stream that works: the service sends a comment every 15 s."""


class EventLog(Connected):
    """The events that the service has stored, and those to come."""

    def events(
        self, *, follow: bool = True, patience_s: float = 60.0, retry_s: float = RETRY_S, **filters: Parameter
    ) -> Iterator[EventRead]:
        """Yield events in their order, each once.

        Args:
            follow: continue forever with new events, over broken connections; otherwise, end with the latest.
            patience_s: longest time without a service before the error is raised.
            retry_s: pause before a broken stream is opened again.
            filters: as in the API: study, kind, after; left out: all events.
        """
        if follow:
            yield from self._follow(filters, patience_s, retry_s)
            return
        while (page := self._connection.get(EventPage, "/events/page", **filters)).items:
            yield from page.items
            filters["after"] = page.last

    def _follow(self, filters: dict[str, Parameter], patience_s: float, retry_s: float) -> Iterator[EventRead]:
        parameters = plain(filters)
        last: int | None = None
        away_since: float | None = None
        while True:
            try:
                for event in self._stream(parameters, last):
                    away_since = None
                    if event is not None:
                        last = event.number
                        yield event
            except (ServiceError, ServiceUnreachable) as error:
                now = time.monotonic()
                away_since = now if away_since is None else away_since
                if is_final(error) or now - away_since > patience_s:
                    raise
            time.sleep(retry_s)

    def _stream(self, parameters: dict[str, Plain], last: int | None) -> Iterator[EventRead | None]:
        """Yield each event of one stream, and None for any other sign that the service is there."""
        headers = {"Accept": "text/event-stream"} | ({} if last is None else {"Last-Event-ID": str(last)})
        with self._connection.stream("GET", "/events", params=parameters, headers=headers, timeout=SILENCE_S) as answer:
            if not answer.headers.get("content-type", "").startswith("text/event-stream"):
                raise self._connection.unknown_service()
            yield None
            for line in answer.iter_lines():  # the service sends the data of each event as one line
                data = line.removeprefix("data:")
                yield self._connection.read(EventRead, data) if data != line else None
