"""Pages and what surrounds every answer: headers that keep browsers from doing more with it than it is for."""

import re
from base64 import b64encode
from hashlib import sha256

from fastapi.responses import HTMLResponse
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

NOTHING = "default-src 'none'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
"""Of an answer that is no page of ours: whatever a browser takes it for, it loads and runs nothing."""

DRAWING = f"{NOTHING}; style-src 'unsafe-inline'"
"""Of an SVG file, which has its style in it."""

ALWAYS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "X-Frame-Options": "DENY",  # what frame-ancestors says, for browsers that do not know it
    "Cross-Origin-Resource-Policy": "same-origin",
}

_SCRIPT = re.compile(r"<script(?![^>]*\bsrc=)[^>]*>(.*?)</script>", re.DOTALL | re.IGNORECASE)


def page(html: str) -> HTMLResponse:
    """A page that runs the scripts in it and those of this service, and no other."""
    return HTMLResponse(html, headers={"Content-Security-Policy": policy(html)})


def policy(html: str) -> str:
    """The policy of a page: scripts by their hashes; styles inline, for figures and documentation have theirs there."""
    hashes = sorted(
        {f"'sha256-{b64encode(sha256(each.encode()).digest()).decode()}'" for each in _SCRIPT.findall(html)}
    )
    return "; ".join(
        (
            "default-src 'none'",
            f"script-src 'self' {' '.join(hashes)}".rstrip(),
            "style-src 'self' 'unsafe-inline'",
            "img-src 'self' data: blob:",
            "font-src 'self' data:",
            "connect-src 'self'",
            "worker-src 'self' blob:",
            "frame-ancestors 'none'",
            "base-uri 'none'",
            "form-action 'self'",
        )
    )


class Headers:
    """Puts the headers on every answer; one that brought a policy of its own keeps it."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in (ALWAYS | {"Content-Security-Policy": _default(headers)}).items():
                    headers.setdefault(name, value)
            await send(message)

        await self.app(scope, receive, guarded if scope["type"] == "http" else send)


def _default(headers: MutableHeaders) -> str:
    return DRAWING if headers.get("content-type", "").startswith("image/svg") else NOTHING
