"""How much a client may send."""

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.problems import FRAMEWORK, problem, response

MOST_BYTES = 1_000_000


class BodyLimit:
    """Refuses a body over `MOST_BYTES` with 413: by what its header announces, and by what really arrives."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request within the limit."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        announced = Headers(scope=scope).get("content-length", "")
        if announced.isdecimal() and int(announced[:20]) > MOST_BYTES:
            refusal = response(problem(*FRAMEWORK[413], _DETAIL), {"Connection": "close"})
            await refusal(scope, receive, send)
            return
        await self.app(scope, _counted(receive), send)


_DETAIL = f"The body has more than {MOST_BYTES:,} bytes; a spec has a few hundred."


def _counted(receive: Receive) -> Receive:
    arrived = 0

    async def count() -> Message:
        nonlocal arrived
        message = await receive()
        arrived += len(message.get("body", b""))
        if arrived > MOST_BYTES:
            raise HTTPException(413, _DETAIL)
        return message

    return count
