"""Limits on the size of a request, on the number of requests at once, and on the number of open streams."""

import resource
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
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

MOST_BYTES_OF = {"/import": MOST_BYTES_OF_IMPORT, "/attachments": 20_000_000, "/robots": 2_000_000}
"""Limits of the addresses that take more than a spec."""


class BodyLimit:
    """Middleware that refuses a body over the limit with 413, by its announced length and by what arrives."""

    def __init__(self, app: ASGIApp, most_bytes: int) -> None:
        self.app = app
        self._most = most_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request within the limit."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        most, detail = self._limit_of(scope["path"])
        announced = Headers(scope=scope).get("content-length", "")
        if announced.isdecimal() and int(announced[:20]) > most:
            refusal = response(problem(*FRAMEWORK[413], detail), {"Connection": "close"})
            await refusal(scope, receive, send)
            return
        await self.app(scope, _counted(receive, most, detail), send)

    def _limit_of(self, path: str) -> tuple[int, str]:
        """Return the limit in bytes, and the detail of its problem."""
        if path in MOST_BYTES_OF:
            return MOST_BYTES_OF[path], f"The body has more than {MOST_BYTES_OF[path]:,} bytes."
        variable = variable_of("body_bytes")
        return self._most, f"The body has more than {self._most:,} bytes ({variable}); a spec has a few hundred."


def _counted(receive: Receive, most: int, detail: str) -> Receive:
    arrived = 0

    async def count() -> Message:
        nonlocal arrived
        message = await receive()
        arrived += len(message.get("body", b""))
        if arrived > most:
            raise HTTPException(413, detail)
        return message

    return count


def most_requests(limits: Limits, files: int | None = None) -> int:
    """Return the most requests to serve at once: the limit, or what half of the files that may be open permit.

    Args:
        limits: of the service.
        files: that may be open; left out: as this process may.
    """
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
            refusal = response(problem(503, "busy", "The service is busy", detail), {"Retry-After": "5"})
            await refusal(scope, receive, send)
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
