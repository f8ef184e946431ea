"""Files that browsers load: compressed once, and not sent again while a browser has them."""

import gzip
from collections.abc import Mapping
from functools import lru_cache
from os import PathLike, stat_result
from pathlib import Path

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.responses import FileResponse, Response
from starlette.staticfiles import NotModifiedResponse, StaticFiles
from starlette.types import Receive, Scope, Send

AGAIN = "no-cache"
"""Kept, and asked about each time: an answer of 304 says that it is still the same."""

FOR_GOOD = "public, max-age=31536000, immutable"
"""Of an address that names the version of what it has."""

WORTH_BYTES = 1_000
TEXTS = ("text/", "application/javascript", "application/json", "image/svg+xml")


class Assets(StaticFiles):
    """Static files with an ETag, that are sent compressed to whoever takes that; an address with `?v=` is for good.

    They are sent whole: a server may do so whatever `Range` says, and then none is wrong.
    """

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        asked = [(name, value) for name, value in scope.get("headers", ()) if name != b"range"]
        await super().__call__(scope | {"headers": asked}, receive, send)

    def file_response(
        self,
        full_path: str | PathLike[str],
        stat_result: stat_result,
        scope: Scope,
        status_code: int = 200,
    ) -> Response:
        """The file, or the news that it has not changed."""
        asked = Headers(scope=scope)
        plain = FileResponse(full_path, status_code=status_code, stat_result=stat_result)
        for_good = b"v=" in scope["query_string"]
        kept = FOR_GOOD if for_good else AGAIN
        told = {"Cache-Control": kept, "Vary": "Accept-Encoding", "Accept-Ranges": "none"}
        plain.headers.update(told)
        if self.is_not_modified(plain.headers, asked):
            return NotModifiedResponse(plain.headers)
        texts = (plain.media_type or "").startswith(TEXTS)
        if not texts or stat_result.st_size < WORTH_BYTES or "gzip" not in asked.get("accept-encoding", ""):
            return plain
        return Compressed(str(full_path), stat_result.st_mtime_ns, plain.headers)


class Compressed(Response):
    """A file, compressed when it is first asked for."""

    def __init__(self, path: str, changed_at: int, headers: Mapping[str, str]) -> None:
        kept = {name: value for name, value in headers.items() if name != "content-length"}
        super().__init__(headers=kept | {"Content-Encoding": "gzip"})
        del self.headers["content-length"]
        self._file = (path, changed_at)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        self.body = await run_in_threadpool(_compressed, *self._file)
        self.headers["content-length"] = str(len(self.body))
        await super().__call__(scope, receive, send)


@lru_cache(maxsize=256)
def _compressed(path: str, changed_at: int) -> bytes:  # noqa: ARG001 - another time is another content
    return gzip.compress(Path(path).read_bytes(), compresslevel=9, mtime=0)
