"""How much a client may send."""

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.problems import FRAMEWORK, problem, response

MOST_BYTES = 1_000_000

MOST_BYTES_OF = {"/import": 64 * 2**20}
"""Of the addresses that take more than a spec."""


class BodyLimit:
    """Refuses a body over what its address takes with 413: by what its header announces, and by what really arrives."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request within the limit."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        most = MOST_BYTES_OF.get(scope["path"], MOST_BYTES)
        announced = Headers(scope=scope).get("content-length", "")
        if announced.isdecimal() and int(announced[:20]) > most:
            refusal = response(problem(*FRAMEWORK[413], _detail(most)), {"Connection": "close"})
            await refusal(scope, receive, send)
            return
        await self.app(scope, _counted(receive, most), send)


def _detail(most: int) -> str:
    hint = "; a spec has a few hundred" if most == MOST_BYTES else ""
    return f"The body has more than {most:,} bytes{hint}."


def _counted(receive: Receive, most: int) -> Receive:
    arrived = 0

    async def count() -> Message:
        nonlocal arrived
        message = await receive()
        arrived += len(message.get("body", b""))
        if arrived > most:
            raise HTTPException(413, _detail(most))
        return message

    return count
