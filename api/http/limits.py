"""Limits on the size of a request, on the number of requests at once, and on the number of open streams."""

import resource
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import SEEK_END
from tempfile import SpooledTemporaryFile
from threading import Lock
from typing import IO

from starlette.datastructures import Headers
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gaplab.api.http.problems import FRAMEWORK, problem, response
from gaplab.schemas.archives import MOST_BYTES_OF_IMPORT
from gaplab.services.core.errors import LimitReached
from gaplab.services.settings import Limits, variable_of

RETRY_AFTER_S = 10
"""Streams end when the pages that show them are closed."""

SPARE = 16
"""Connections beyond the most requests at once, which are answered with a problem, or learn that the process lives."""

ALIVE = "/livez"

MOST_BYTES_OF = {
    "/import": MOST_BYTES_OF_IMPORT,
    "/attachments": 20_000_000,
    "/robots": 2_000_000,
    "/pools": 8_000_000,
}
"""Limits of the addresses that take more than a spec."""


SMALL = 2**16
"""Bytes of a body for which there is always room, in memory; a larger one is kept on the disk."""

MOST_BYTES_AT_ONCE = MOST_BYTES_OF_IMPORT
"""Bytes of all bodies of a process together that have arrived, and whose requests have not ended."""


class BodyLimit:
    """Middleware that takes in a whole body, as `request.state.body`, before anything else is done for the request.

    A body over the limit is refused with 413, by its announced length and by what arrives, and one for which there is
    no room beside the others with 503.
    """

    def __init__(self, app: ASGIApp, most_bytes: int, most_at_once: int = MOST_BYTES_AT_ONCE) -> None:
        self.app = app
        self._most, self._most_at_once, self._at_once = most_bytes, most_at_once, 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request within the limits, unless its client leaves before its end."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        with SpooledTemporaryFile(SMALL) as body, suppress(ClientDisconnect):
            try:
                answer = await self._refusal(scope, receive, body) or self.app
                scope.setdefault("state", {})["body"] = body
                await answer(scope, _again(body, receive), send)
            finally:
                self._at_once -= body.seek(0, SEEK_END)

    async def _refusal(self, scope: Scope, receive: Receive, body: IO[bytes]) -> Response | None:
        """Take in the body, and return the answer to one that is refused."""
        most, detail = self._limit_of(scope["path"])
        too_large = response(problem(*FRAMEWORK[413], detail), {"Connection": "close"})
        announced = Headers(scope=scope).get("content-length", "")
        if announced.isdecimal() and int(announced[:20]) > most:
            return too_large
        async for part in Request(scope, receive).stream():
            self._at_once += body.write(part)
            if body.tell() > most:
                return too_large
            if body.tell() > SMALL and self._at_once > self._most_at_once:
                return busy("the bodies of other requests have taken all room")
        body.seek(0)
        return None

    def _limit_of(self, path: str) -> tuple[int, str]:
        """Return the limit in bytes, and the detail of its problem."""
        if path in MOST_BYTES_OF:
            return MOST_BYTES_OF[path], f"The body has more than {MOST_BYTES_OF[path]:,} bytes."
        variable = variable_of("body_bytes")
        return self._most, f"The body has more than {self._most:,} bytes ({variable}); a spec has a few hundred."


def _again(body: IO[bytes], receive: Receive) -> Receive:
    """Return a receiver of a body that has arrived, and then of what follows it."""
    unread = [body]

    async def part() -> Message:
        return {"type": "http.request", "body": unread.pop().read()} if unread else await receive()

    return part


def busy(detail: str) -> Response:
    """Return the answer to a request for which there is no room now."""
    return response(problem(503, "busy", "The service is busy", detail), {"Retry-After": "5"})


def most_requests(limits: Limits, files: int | None = None) -> int:
    """Return the most requests to serve at once: the limit, or what half of the files that may be open permit."""
    files = resource.getrlimit(resource.RLIMIT_NOFILE)[0] if files is None else files
    return limits.requests if files == resource.RLIM_INFINITY else min(limits.requests, max(1, files // 2 - SPARE))


class RequestLimit:
    """Middleware that answers 503 beyond the most requests at once, but always says that the process lives."""

    def __init__(self, app: ASGIApp, most: int) -> None:
        self.app = app
        self._most = most
        self._open = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request unless too many are being served."""
        if scope["type"] != "http" or scope["path"] == ALIVE:
            await self.app(scope, receive, send)
            return
        if self._open >= self._most:
            detail = f"{self._open} requests are being served; at most {self._most} may be ({variable_of('requests')})"
            await busy(detail)(scope, receive, send)
            return
        self._open += 1
        try:
            await self.app(scope, receive, send)
        finally:
            self._open -= 1


class Streams:
    """Counts the open streams of this process, and limits them for each token and in all.

    with streams.open(caller.token):
        ...
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._open: Counter[str | None] = Counter()
        self._lock = Lock()

    @contextmanager
    def open(self, token: str | None) -> Iterator[None]:
        """Count one more stream of this token while the context lasts.

        Raises:
            LimitReached: too many are open; the message names the limit.
        """
        with self._lock:
            self._check("streams_per_token", self._open[token], "of this token ")
            self._check("streams", self._open.total(), "")
            self._open[token] += 1
        try:
            yield
        finally:
            with self._lock:
                self._open[token] -= 1

    def _check(self, name: str, present: int, whose: str) -> None:
        if present >= (limit := getattr(self._limits, name)):
            msg = f"{present} streams {whose}are open; at most {limit} may be ({variable_of(name)})"
            raise LimitReached(msg, RETRY_AFTER_S)
