"""What clients asked for and what they were told: one line of JSON for each request."""

import json
import time
from dataclasses import asdict, dataclass, field
from threading import Lock
from typing import Any

import httpx2


@dataclass(frozen=True)
class Record:
    """A request with its answer.

    Attributes:
        verb: submit, or one of the life cycle's; read.
        path: that was asked.
        body: that was sent, if any.
        sent_at, answered_at: seconds since 1970.
        status: of the answer; None where none came: whether the request took effect is not known then.
        answer: what came; of a submission, the new resource.
    """

    verb: str
    path: str
    body: dict | None
    sent_at: float
    answered_at: float
    status: int | None
    answer: dict = field(default_factory=dict)

    @property
    def acknowledged(self) -> Any:
        return self.status is not None and 200 <= self.status < 300

    @property
    def id(self) -> Any:
        """Of what a verb is about: the second part of /studies/ID/cancel."""
        return self.path.split("/")[2]


class History:
    """Appends to a file, from many threads, so that it outlives whoever writes it."""

    def __init__(self, path: Any) -> None:
        self._path = path
        self._lock = Lock()

    def ask(self, http: Any, verb: Any, method: Any, path: Any, body: Any = None, **sent: Any) -> Any:
        """Ask, write down what came, and return it; the body is sent as JSON, unless something else is `sent`."""
        sent_at, status, answer = time.time(), None, {}
        try:
            response = http.request(method, path, **({"json": body} if "content" not in sent else {}), **sent)
            status, answer = response.status_code, response.json()
        except (httpx2.HTTPError, ValueError) as error:
            answer = {"error": type(error).__name__}
        if verb == "read" and status == 200:
            answer = {}
        record = Record(verb, path, body, sent_at, time.time(), status, answer)
        with self._lock, self._path.open("a") as file:
            file.write(json.dumps(asdict(record)) + "\n")
        return record

    def records(self) -> Any:
        return [Record(**json.loads(line)) for line in self._path.read_text().splitlines()]
