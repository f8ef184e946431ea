"""A connection to a service: one request and its answer, tried again where that is safe."""

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import TracebackType
from typing import Any, Self, TypeVar
from uuid import uuid4

import httpx2
from pydantic import TypeAdapter, ValidationError

from gaplab.api.clients.errors import ServiceError, ServiceUnreachable, problem_of
from gaplab.services.settings import Settings

T = TypeVar("T")

LOOPBACK = {"127.0.0.1", "localhost", "::1"}
"""This machine: no proxy of the environment leads to it."""

PAUSES_S = (0.2, 1.0, 3.0)
"""Before each further try of a request whose answer was lost, or that the service could not serve just then."""

PASSING = {502, 503, 504}
"""Answers that pass: the database is away for a moment, or the service behind a proxy."""


class Connection:
    """A connection to a service.

    Args:
        url: of the service; left out: GAPLAB_URL, or this machine.
        token: to show; left out: GAPLAB_TOKEN, or none; "" for none.
        timeout_s: for which an answer is waited.
        transport: instead of the network, for tests.

    Every method raises ServiceError with the service's problem, or ServiceUnreachable.
    """

    def __init__(
        self,
        url: str | None = None,
        *,
        token: str | None = None,
        timeout_s: float = 60.0,
        transport: httpx2.BaseTransport | None = None,
    ) -> None:
        self.url = url = Settings.from_environment().url if url is None else url
        shown = os.environ.get("GAPLAB_TOKEN") if token is None else token
        headers = {"Authorization": f"Bearer {shown}"} if shown else {}
        if shown and not (shown.isascii() and shown.isprintable()):
            msg = "the token has characters that no token of this service has"
            raise ServiceUnreachable(msg)
        try:
            here = httpx2.URL(url).host in LOOPBACK
            self._http = httpx2.Client(
                base_url=url, headers=headers, timeout=timeout_s, transport=transport, trust_env=not here
            )
        except (httpx2.InvalidURL, UnicodeEncodeError) as error:
            msg = f"{url!r} is no address of a service: {error}"
            raise ServiceUnreachable(msg) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection."""
        self._http.close()

    def ready(self) -> bool:
        """Whether the service answers and its database can be used."""
        try:
            self._request("GET", "/readyz")
        except (ServiceError, ServiceUnreachable):
            return False
        return True

    def _get(self, path: str, **parameters: str | int | Sequence[str] | None) -> httpx2.Response:
        """What is read changes nothing, so it is asked for again if the answer is lost."""
        given = {name: value for name, value in parameters.items() if value is not None}
        return self._patiently("GET", path, params=given)

    def _create(self, path: str, body: Mapping[str, Any]) -> httpx2.Response:
        """POST what creates something. If the answer is lost it is asked again: its key lets it be done only once."""
        return self._patiently("POST", path, json=body, headers={"Idempotency-Key": uuid4().hex})

    def _patiently(self, method: str, path: str, **request: Any) -> httpx2.Response:  # noqa: ANN401 - as `_request`
        """A request that may be made more than once."""
        for pause_s in PAUSES_S:
            try:
                return self._request(method, path, **request)
            except ServiceUnreachable as error:
                if isinstance(error.__cause__, httpx2.ConnectError | httpx2.InvalidURL | httpx2.UnsupportedProtocol):
                    raise
            except ServiceError as error:
                if error.problem.status not in PASSING:
                    raise
            time.sleep(pause_s)
        return self._request(method, path, **request)

    def _request(
        self,
        method: str,
        path: str,
        *,
        params: Mapping[str, Any] | None = None,
        json: object = None,
        headers: Mapping[str, str] | None = None,
    ) -> httpx2.Response:
        with self._reached():
            return self._successful(self._http.request(method, path, params=params, json=json, headers=headers))

    @contextmanager
    def _reached(self) -> Iterator[None]:
        try:
            yield
        except (httpx2.RequestError, httpx2.InvalidURL) as error:
            msg = f"no service answers at {self.url} ({type(error).__name__}); start one with `gaplab serve`"
            raise ServiceUnreachable(msg) from error

    def _successful(self, answer: httpx2.Response) -> httpx2.Response:
        if answer.is_success:
            return answer
        answer.read()
        raise ServiceError(problem_of(answer))

    def _read(self, kind: type[T], answer: httpx2.Response) -> T:
        try:
            return TypeAdapter(kind).validate_json(answer.content)
        except ValidationError as error:
            msg = f"what answers at {self.url} is no gaplab of this version"
            raise ServiceUnreachable(msg) from error
