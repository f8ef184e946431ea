"""Who is let in: every request is asked for its token before anything else looks at it.

Reading wants a reader's token, and whatever else a method does a runner's. That follows from the method, so that no new
route can forget it; but for what is asked with a body and changes nothing.
"""

from urllib.parse import urlsplit

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.types import ASGIApp, Receive, Scope, Send

from gaplab.api.http import problems
from gaplab.schemas.access import Role
from gaplab.services.access import ANYONE, Caller, authenticate, demand, is_loopback
from gaplab.services.core.errors import Forbidden, GaplabError, StoreUnavailable
from gaplab.services.settings import Settings

OPEN = {"/livez", "/readyz"}
"""For whoever keeps the service alive; they tell nothing else."""

ASSETS = "/assets/"
"""Files of the page at `/`, which like the page hold no data: it asks its reader for the token."""

WITHOUT_A_STORE = "/metrics"
"""Says that the database is away, and nothing of what is in it then, also to whoever cannot be known."""

READING = {"GET", "HEAD", "OPTIONS"}

ASKING = {"/studies/estimate"}
"""Reading, though it is a POST: the question is too long for an address."""


class Access:
    """Lets a request through with its caller in `request.state.caller`, or answers it with a problem.

    Args:
        app: what is guarded.
        settings: of the process that serves; None serves a program in its own process, under whatever name it likes.
    """

    def __init__(self, app: ASGIApp, settings: Settings | None) -> None:
        self.app = app
        self._required = settings is not None and not is_loopback(settings.host)
        self._by_name = settings is not None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request if its caller may ask it."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        request = Request(scope)
        if scope["path"] in OPEN or scope["path"] == "/" or scope["path"].startswith(ASSETS):
            request.state.caller = ANYONE
            await self.app(scope, receive, send)
            return
        try:
            request.state.caller = await run_in_threadpool(self._admit, request)
        except StoreUnavailable as error:
            if scope["path"] != WITHOUT_A_STORE:
                await problems.of_gaplab(request, error)(scope, receive, send)
                return
            request.state.caller = ANYONE
        except GaplabError as error:
            await problems.of_gaplab(request, error)(scope, receive, send)
            return
        await self.app(scope, receive, send)

    def _admit(self, request: Request) -> Caller:
        scheme, _, shown = request.headers.get("authorization", "").partition(" ")
        token = shown.strip() if scheme.lower() == "bearer" else scheme or None
        caller = authenticate(request.app.state.store, token, required=self._required)
        if caller.token is None and self._by_name:
            _refuse_other_sites(request)
        reads = request.method in READING or request.scope["path"] in ASKING
        role = Role.READER if reads else Role.RUNNER
        demand(caller, role, f"{request.method} here")
        return caller


def _refuse_other_sites(request: Request) -> None:
    """Do nothing if the request was meant for this machine: a browser asks on behalf of any page that it shows.

    A page of another site names its `Origin`; one whose name was made to lead here names itself as `Host`.

    Raises:
        Forbidden: it was meant for something else.
    """
    host = request.headers.get("host", "")
    if not is_loopback(_without_port(host)):
        msg = f"without tokens only 127.0.0.1, [::1] and localhost are served here, not {host[:100]!r}"
        raise Forbidden(msg)
    origin = request.headers.get("origin")
    if origin is not None and origin.partition("://")[2] != host:
        msg = f"without tokens no page of another site may ask here, and {origin[:100]!r} is one"
        raise Forbidden(msg)


def _without_port(host: str) -> str:
    """The name in a `Host`; empty where it is no host at all."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""
