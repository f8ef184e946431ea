"""Events as a client gets them: one iterator, however often the connection breaks."""

import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import httpx2
from pydantic import ValidationError

from gaplab.api.clients.errors import ServiceError, ServiceUnreachable, is_for_good, problem_of
from gaplab.schemas.events import EventRead

RETRY_S = 1.0
"""Before a broken stream is opened again."""

SILENCE_S = 45.0
"""A stream that says nothing for so long is broken: the service sends a comment every 15 s."""


def follow(
    http: httpx2.Client, filters: Mapping[str, str | int | Sequence[str] | None], *, patience_s: float
) -> Iterator[EventRead]:
    """Events in their order, each once; a stream that breaks is resumed after the last of them.

    Args:
        http: of the service.
        filters: as in the API: experiment, study, kind, after.
        patience_s: how long the service may be away.

    Raises:
        ServiceError: the service refuses.
        ServiceUnreachable: it was away for too long, or what answers is no gaplab of this version.
    """
    parameters = {name: value for name, value in filters.items() if value is not None}
    last: int | None = None
    away_since: float | None = None
    while True:
        try:
            for each in _stream(http, parameters, last):
                away_since = None
                if each is not None:
                    last = each.number
                    yield each
        except (ServiceError, httpx2.RequestError) as error:
            now = time.monotonic()
            away_since = now if away_since is None else away_since
            if is_for_good(error) or now - away_since > patience_s:
                raise _named(error, http) from error
        time.sleep(RETRY_S)


def _stream(http: httpx2.Client, parameters: Mapping[str, Any], last: int | None) -> Iterator[EventRead | None]:
    """Each event; None for whatever else says that the service is there, which may be all for days."""
    headers = {"Accept": "text/event-stream"} | ({} if last is None else {"Last-Event-ID": str(last)})
    with http.stream("GET", "/events", params=parameters, headers=headers, timeout=SILENCE_S) as answer:
        if not answer.is_success:
            answer.read()
            raise ServiceError(problem_of(answer))
        if not answer.headers.get("content-type", "").startswith("text/event-stream"):
            raise _foreign(http)
        yield None
        for line in answer.iter_lines():  # the service sends each event's data as one line
            yield _read(line.removeprefix("data:"), http) if line.startswith("data:") else None


def _read(data: str, http: httpx2.Client) -> EventRead:
    try:
        return EventRead.model_validate_json(data)
    except ValidationError as error:
        raise _foreign(http) from error


def _foreign(http: httpx2.Client) -> ServiceUnreachable:
    return ServiceUnreachable(f"what answers at {http.base_url} is no gaplab of this version")


def _named(error: Exception, http: httpx2.Client) -> Exception:
    if isinstance(error, ServiceError):
        return error
    msg = f"no service answers at {http.base_url} ({type(error).__name__}); start one with `gaplab serve`"
    return ServiceUnreachable(msg)
