"""Access control: a request is authenticated before any other code sees it.

A request that reads and lasts, like a stream, is authenticated again and again.

Methods that only read need a reader's token, all others a runner's. The method alone decides, so that no new route can
forget it; the exception is a POST that only asks.
"""

import asyncio
from urllib.parse import urlsplit

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gaplab.api.http import problems
from gaplab.schemas.access import Role
from gaplab.services.access import ANYONE, Caller, authenticate, demand, is_loopback
from gaplab.services.core.errors import Forbidden, GaplabError
from gaplab.services.settings import Settings
from gaplab.services.store.database_errors import StoreUnavailable

OPEN = {"/livez", "/readyz"}
"""Health checks, which reveal nothing else."""

ASSETS = "/assets/"
"""Static files, which hold no data, like the page at `/`; the page asks people for their token."""

WITHOUT_A_STORE = "/metrics"
"""The path that needs no token while the database does not answer, since it then says only that."""

RECHECK_S = 10.0
"""Pause between checks of the caller of a request that lasts; less than the pause between heartbeats of a stream."""

READING = {"GET", "HEAD", "OPTIONS"}

ASKING = {"/studies/estimate", "/samples/check"}
"""POST requests that only read: the question is too long for an address."""


class Access:
    """Middleware that sets `request.state.caller`, or answers with a problem.

    Without settings, it accepts any host name, for a program that calls the app directly.
    """

    def __init__(self, app: ASGIApp, settings: Settings | None) -> None:
        self.app = app
        self._required = settings is not None and not is_loopback(settings.host)
        self._checks_host = settings is not None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request if its caller may send it."""
        path = scope.get("path", "")
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        request = Request(scope)
        request.state.caller = ANYONE
        if path in OPEN or path == "/" or path.startswith(ASSETS):
            await self.app(scope, receive, send)
            return
        try:
            request.state.caller = await run_in_threadpool(self._authenticate, request)
        except GaplabError as error:
            if not (isinstance(error, StoreUnavailable) and path == WITHOUT_A_STORE):
                await problems.of_gaplab(request, error)(scope, receive, send)
                return
        if request.method in READING:
            await self._serve(request, receive, send)
        else:  # a write under way is finished, and answered by its result
            await self.app(scope, receive, send)

    async def _serve(self, request: Request, receive: Receive, send: Send) -> None:
        """Serve a request for as long as its caller has access; then an answer that has begun is broken off."""
        lost: list[GaplabError] = []
        has_begun = False

        async def noting(message: Message) -> None:
            nonlocal has_begun
            has_begun = True
            await send(message)

        try:
            async with asyncio.timeout(None) as interruption:
                checking = asyncio.create_task(self._recheck(request, lost, interruption))
                try:
                    await self.app(request.scope, receive, noting)
                finally:
                    checking.cancel()
        except TimeoutError:
            if not lost:  # then it is an error of the application
                raise
            if not has_begun:
                await problems.of_gaplab(request, lost[0])(request.scope, receive, send)

    async def _recheck(self, request: Request, lost: list[GaplabError], interruption: asyncio.Timeout) -> None:
        """Interrupt the request once its caller has lost access, and add the reason to `lost`."""
        while not lost:
            await asyncio.sleep(RECHECK_S)
            try:
                await run_in_threadpool(self._authenticate, request)
            except StoreUnavailable:
                continue
            except GaplabError as error:
                lost.append(error)
        interruption.reschedule(0.0)

    def _authenticate(self, request: Request) -> Caller:
        scheme, _, credentials = request.headers.get("authorization", "").partition(" ")
        token = credentials.strip() if scheme.lower() == "bearer" else scheme or None
        caller = authenticate(request.app.state.store, token, required=self._required)
        if caller.token is None and self._checks_host:
            _refuse_other_sites(request)
        only_reads = request.method in READING or request.scope["path"] in ASKING
        demand(caller, Role.READER if only_reads else Role.RUNNER, f"{request.method} here")
        return caller


def _refuse_other_sites(request: Request) -> None:
    """Refuse requests that a browser sends for a page of another site.

    A page of another site names its `Origin`; one whose host name resolves to this machine names itself as `Host`.

    Raises:
        Forbidden: another site sent the request.
    """
    host = request.headers.get("host", "")
    if not is_loopback(_without_port(host)):
        raise Forbidden(f"without tokens, the host must be 127.0.0.1, [::1] or localhost, not {host[:100]!r}")
    origin = request.headers.get("origin")
    if origin is not None and origin.partition("://")[2] != host:
        msg = f"without tokens, pages of other sites have no access; this request comes from {origin[:100]!r}"
        raise Forbidden(msg)


def _without_port(host: str) -> str:
    """Return the name in a `Host` header; empty if the header is invalid."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""
