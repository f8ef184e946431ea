"""Static files: compressed once, and not sent again to a browser that has them."""

import gzip
import re
import time
from functools import lru_cache
from hashlib import blake2b
from os import PathLike
from pathlib import Path

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.responses import FileResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Receive, Scope, Send

REVALIDATE = "no-cache"
"""Browsers keep the file but ask each time whether it has changed, which a 304 answers."""

IMMUTABLE = "public, max-age=31536000, immutable"
"""For an address that names the version of the file."""

COMPRESS_FROM_BYTES = 1_000
TEXTS = ("text/", "application/javascript", "application/json", "image/svg+xml")


class Assets(StaticFiles):
    """Static files with an ETag, compressed for clients that accept it.

    An address with `?v=` is immutable, and so is one whose path has the `version` of the folder of now: modules that
    import each other by relative paths then need no request at all on the next visit. Files are always sent whole: a
    server may ignore `Range`, and then no range can be wrong.
    """

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request without its `Range`."""
        headers = [(name, value) for name, value in scope.get("headers", ()) if name != b"range"]
        await super().__call__({**scope, "headers": headers}, receive, send)

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Return the file, or 304 if the client has it."""
        response = await super().get_response(path, scope)
        response.headers["Cache-Control"] = IMMUTABLE if self._is_versioned(scope) else REVALIDATE
        response.headers["Vary"] = "Accept-Encoding"
        response.headers["Accept-Ranges"] = "none"
        if not isinstance(response, FileResponse) or "gzip" not in Headers(scope=scope).get("accept-encoding", ""):
            return response
        size, is_text = int(response.headers["content-length"]), (response.media_type or "").startswith(TEXTS)
        if not is_text or size < COMPRESS_FROM_BYTES:
            return response
        body = await run_in_threadpool(_compressed, str(response.path), response.headers["etag"])
        kept = {name: value for name, value in response.headers.items() if name != "content-length"}
        return Response(body, headers=kept | {"Content-Encoding": "gzip"})

    def _is_versioned(self, scope: Scope) -> bool:
        named = scope.get("path_params", {}).get("version")
        now = int(time.monotonic())
        return b"v=" in scope["query_string"] or (named is not None and named == _version_in(str(self.directory), now))


def version_of(folder: str | PathLike[str] | None) -> str:
    """Return a version of the files of a folder, which changes when one of them does."""
    files = sorted(path for path in Path(folder or "").rglob("*") if path.is_file())
    facts = [(str(path), (found := path.stat()).st_mtime_ns, found.st_size) for path in files]
    return blake2b(repr(facts).encode(), digest_size=6).hexdigest()


@lru_cache(maxsize=4)
def _version_in(folder: str, second: int) -> str:  # noqa: ARG001 - the key of a version that is young enough
    """Return the version of a folder as of up to a second ago: a page asks for a hundred of its files at once."""
    return version_of(folder)


@lru_cache(maxsize=256)
def _compressed(path: str, etag: str) -> bytes:  # noqa: ARG001 - the key of this version of the file
    return gzip.compress(Path(path).read_bytes(), compresslevel=9, mtime=0)


_IMPORTED = re.compile(r'^(?:import|export)\s(?:[^"\';]*?\sfrom\s+)?"(\.{1,2}/[^"]+)"', re.MULTILINE)


def modules_of(folder: Path, script: str) -> tuple[str, ...]:
    """Return the paths of a script and of what it imports statically, directly or not.

    A browser learns what a module imports only when it has the module, so each level of imports would wait for the
    level above. Paths are in the folder, with slashes.
    """
    found: dict[str, None] = {}
    waiting = [script]
    while waiting:
        path = waiting.pop(0)
        if path not in found:
            found[path] = None
            file = folder / path
            imported = _IMPORTED.findall(file.read_text(encoding="utf-8"))
            waiting += [(file.parent / each).resolve().relative_to(folder.resolve()).as_posix() for each in imported]
    return tuple(found)
