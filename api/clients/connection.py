"""A connection to a service: requests and typed answers, repeated where that is safe."""

import os
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias, TypedDict, TypeVar, Unpack, cast
from urllib.parse import quote
from uuid import uuid4

import httpx2
from pydantic import TypeAdapter, ValidationError

from gaplab.api.clients.bodies import json_of
from gaplab.api.clients.errors import ServiceError, ServiceUnreachable, UnknownService, error_of, format_of
from gaplab.schemas.base import LINE, shortened, table
from gaplab.schemas.measurements import AnswerRead, AttachmentRead, RequestRead
from gaplab.schemas.records import ExperimentRead, Page, StudyRead
from gaplab.services.settings import InvalidSetting, Settings

T = TypeVar("T")
Item = TypeVar("Item", covariant=True)


Of: TypeAlias = str | StudyRead | ExperimentRead | RequestRead | AnswerRead | AttachmentRead
"""A study, one experiment of it, or whatever else a method is about: its id, or itself."""

Parameter = Of | int | float | Sequence[Of | int | float] | None
Plain = str | int | float | Sequence[str]

LOOPBACK = {"127.0.0.1", "localhost", "::1"}
"""Hosts that are this machine; requests to them ignore the proxies of the environment."""

PAUSES_S = (0.2, 1.0, 3.0)
"""Pauses before each repetition of a request that was lost or that the service could not serve."""

PASSING = {502, 503, 504}
"""Statuses of passing failures: the database does not answer, or the service behind a proxy does not."""

STORED_S = 600.0
"""Longest wait until the service has stored a file, like a large archive."""

BUSY = 429
"""Status of a GET whose turn has not come: others compute replays or draw figures. The answer says how long to wait."""

CONFIRMED = "?confirm_cost=true"
"""Query that lets a request take any number of core-hours."""

FINAL = (httpx2.ConnectError, httpx2.InvalidURL, httpx2.UnsupportedProtocol)
"""Errors of a request that a repetition would meet again."""


class Request(TypedDict, total=False):
    """Optional parts of a request."""

    params: Mapping[str, Plain]
    json: object
    content: Iterable[bytes]
    headers: Mapping[str, str]
    timeout: float


class Rows(tuple[Item, ...]):
    """Several of a kind, as a tuple that is one line at a prompt and a table in a notebook."""

    __slots__ = ()

    def __repr__(self) -> str:
        kind = type(self[0]).__name__ if self else "none"
        return shortened(f"<{len(self)} {kind}{': ' if self else ''}{', '.join(map(repr, self[:2]))}", LINE - 1) + ">"

    def _repr_html_(self) -> str:
        return table(self)


_certificates = cache(httpx2.create_ssl_context)
"""The certificates that https trusts, read once for a process: reading them takes longer than most requests."""


class Connection:
    """A connection to a service; the arguments and the errors are those of `gaplab.Client`."""

    def __init__(
        self,
        url: str | None = None,
        *,
        token: str | None = None,
        timeout_s: float = 60.0,
        transport: httpx2.BaseTransport | None = None,
        pauses_s: Sequence[float] = PAUSES_S,
    ) -> None:
        self.owner: object = None
        self.url = url = _configured_url() if url is None else url
        self._pauses_s, self._timeout_s = pauses_s, timeout_s
        token = os.environ.get("GAPLAB_TOKEN") if token is None else token
        if token and not (token.isascii() and token.isprintable()):
            msg = "the token has characters that no token of this service has; check GAPLAB_TOKEN for line breaks"
            raise ServiceUnreachable(msg)
        try:
            address = httpx2.URL(url)
            here = address.host in LOOPBACK
            self._http = httpx2.Client(
                base_url=url,
                headers={"Authorization": f"Bearer {token}"} if token else {},
                timeout=timeout_s,
                verify=not (here and address.scheme == "http") and _certificates(),
                transport=transport,
                trust_env=not here,
            )
        except (httpx2.InvalidURL, UnicodeEncodeError) as error:
            raise ServiceUnreachable(f"{url!r} is not the address of a service: {error}") from error
        if self._http.base_url.scheme not in {"http", "https"}:
            raise ServiceUnreachable(_without_scheme(url))

    def close(self) -> None:
        """Close the connection."""
        self._http.close()

    def get(self, kind: type[T], path: str, /, **parameters: Parameter) -> T:
        """Return the answer to a GET as a value of this type."""
        return self.read(kind, self.get_bytes(path, **parameters))

    def get_bytes(self, path: str, /, **parameters: Parameter) -> bytes:
        """Return the answer to a GET as it is; with `wait_s`, the service may take so much longer."""
        given = plain(parameters)
        wait_s = given.get("wait_s")
        timeout_s = self._timeout_s + (wait_s if isinstance(wait_s, int | float) else 0.0)
        return self._repeat("GET", path, params=given, timeout=timeout_s)

    def save(self, file: str | Path, path: str, formats: Sequence[str], /, **parameters: Parameter) -> Path:
        """Write the answer to a GET into a file, in the format of its suffix if there are several; folders are created.

        Raises:
            WrongSuffix: the suffix is not one of these formats.
        """
        chosen = {"format": format_of(file, formats)}
        return written(file, self.get_bytes(path, **parameters | (chosen if len(formats) > 1 else {})))

    def items(self, page: type[Page[T]], path: str, /, **parameters: Parameter) -> Iterator[T]:
        """Yield every item of a list, page after page."""
        cursor = None
        while True:
            answer = self.get(page, path, cursor=cursor, **parameters)
            yield from answer.items
            if (cursor := answer.next) is None:
                return

    def post(self, kind: type[T], path: str, body: object, *, key: str | None = None) -> T:
        """Return the answer to a POST that may be repeated: with its idempotency key, the service does it only once.

        The key is that of an earlier try; left out: a new one.
        """
        headers = {"Idempotency-Key": key or uuid4().hex}
        return self.read(kind, self._repeat("POST", path, json=body, headers=headers))

    def change(self, kind: type[T], method: str, path: str, **request: Unpack[Request]) -> T:
        """Return the answer to a request that must not be repeated."""
        return self.read(kind, self._send(method, path, **request))

    def upload(self, kind: type[T], path: str, content: Iterable[bytes], media_type: str) -> T:
        """Return the answer to a POST of a file, whose content comes in parts; it may take `STORED_S`."""
        headers = {"Content-Type": media_type}
        return self.change(kind, "POST", path, content=content, headers=headers, timeout=STORED_S)

    @contextmanager
    def stream(self, method: str, path: str, **request: Unpack[Request]) -> Iterator[httpx2.Response]:
        """Send a request whose answer is read in parts.

        Raises:
            ValueError: a number of the body is not finite.
            TypeError: JSON cannot hold a value of the body.
        """
        if "json" in request:
            request["json"] = json_of(request["json"])
        try:
            with self._http.stream(method, path, **request) as answer:
                if not answer.is_success:
                    answer.read()
                    raise error_of(answer)
                yield answer
        except httpx2.ReadTimeout as error:
            timeout_s = request.get("timeout", self._timeout_s)
            msg = f"the service at {self.url} has not answered within {timeout_s:g} s"
            raise ServiceUnreachable(msg) from error
        except (httpx2.RequestError, httpx2.InvalidURL) as error:
            msg = f"no service answers at {self.url} ({type(error).__name__}); start one with `gaplab serve`"
            raise ServiceUnreachable(msg) from error

    def read(self, kind: type[T], content: str | bytes) -> T:
        """Return JSON of the service as a value of this type; what has methods of its own asks the owner with them."""
        try:
            found: Any = TypeAdapter(kind).validate_json(content, context={"client": self.owner})
            return cast("T", Rows(found) if type(found) is tuple else found)
        except ValidationError as error:
            raise self.unknown_service() from error

    def unknown_service(self) -> UnknownService:
        """Return the error for an answer that this version cannot read."""
        return UnknownService(f"what answers at {self.url} is not gaplab of this version")

    def _repeat(self, method: str, path: str, **request: Unpack[Request]) -> bytes:
        final = (*FINAL, httpx2.ReadTimeout) if method == "GET" else FINAL  # asked again, it is as slow
        for pause_s in self._pauses_s:
            try:
                return self._send(method, path, **request)
            except ServiceUnreachable as error:
                if isinstance(error.__cause__, final):
                    raise
            except ServiceError as error:
                if method == "GET" and error.problem.status == BUSY and error.retry_after_s is not None:
                    pause_s = max(pause_s, error.retry_after_s)
                elif error.problem.status not in PASSING:
                    raise
            time.sleep(pause_s)
        return self._send(method, path, **request)

    def _send(self, method: str, path: str, **request: Unpack[Request]) -> bytes:
        with self.stream(method, path, **request) as answer:
            return answer.read()


class Connected:
    """What sends its requests over one connection."""

    _connection: Connection


def _configured_url() -> str:
    """Return the address of the environment's settings.

    Raises:
        ServiceUnreachable: GAPLAB_URL is not an address.
        InvalidSetting: another setting is not permitted.
    """
    try:
        return Settings.from_environment().url
    except InvalidSetting as error:
        if error.variable == "GAPLAB_URL":
            raise ServiceUnreachable(str(error)) from error
        raise


def _without_scheme(url: str) -> str:
    """Return what to write in place of an address without http:// or https://."""
    rest = url.partition("://")[2] if "://" in url else url
    return f"{url!r} is not the address of a service: it begins with http:// or https://, like http://{rest or 'HOST'}"


def id_of(of: Of) -> str:
    """Return the id of what may be given in place of it.

    Raises:
        TypeError: it has none.
    """
    id = getattr(of, "id", of)
    if not isinstance(id, str):
        raise TypeError(f"an id or a name is a text, not {id!r:.100}")
    return id


def plain(parameters: Mapping[str, Parameter]) -> dict[str, Plain]:
    """Return the parameters that are given, with ids in place of studies and experiments."""

    def with_ids(value: Of | float | Sequence[Of | float]) -> Plain:
        if isinstance(value, str | int | float):
            return value
        return [str(with_ids(each)) for each in value] if isinstance(value, Sequence) else id_of(value)

    return {name: with_ids(value) for name, value in parameters.items() if value is not None}


def written(file: str | Path, content: bytes) -> Path:
    """Write a file, and return its path; missing folders are created."""
    path = Path(file)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return path


def segment(of: Of) -> str:
    """Return any id or name as one segment of a path; servers decode a slash before they split the path.

    Raises:
        TypeError: it is not text, a study or an experiment.
    """
    return quote(id_of(of).replace("/", "%2F"), safe="", errors="replace").replace(".", "%2E") or "%20"
