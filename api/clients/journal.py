"""The journal of a driver: what was measured is on its own disk before it is sent, and until the service has it."""

import json
import logging
import os
import time
from collections.abc import Iterator, Sequence
from math import isfinite
from pathlib import Path
from typing import Any, Self
from uuid import uuid4

from gaplab.api.clients.connection import Connection, segment
from gaplab.api.clients.errors import ServiceError, ServiceUnreachable, is_of_gaplab, refuses_sender
from gaplab.schemas.measurements import AnswerRead

log = logging.getLogger("gaplab.driver")


class Journal:
    """Lines of JSON in a file, each on disk when its method returns; without a file, they are in memory.

    A line is a repeat of a request, an answer with its idempotency key, or the note that the service has an answer. One
    that is none of these, as a power cut leaves, is logged once, and copied to a file beside, `*.unreadable`.

    Args:
        file: created, for its owner alone, if it does not exist; None: no file.
    """

    def __init__(self, file: str | Path | None = None) -> None:
        self._lines: list[dict[str, Any]] = []
        self._file = None
        if file is not None:
            path = Path(file)
            content = path.read_bytes() if path.exists() else b""
            self._lines = list(_lines(content, path.with_name(f"{path.name}.unreadable")))
            path.touch(0o600)
            self._file = path.open("ab")
            if content and not content.endswith(b"\n"):
                self._file.write(b"\n")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.close()

    def repeat(self, request: str, value: float, readings: Any = None, void: Sequence[str] = ()) -> None:  # noqa: ANN401 - JSON
        """Keep the value of one repeat, with the answers to its request that counted once and were void by then."""
        self._write({"request": request, "repeat": value, "readings": readings, "void": list(void)})

    def forget(self, request: str) -> None:
        """Note that the repeats of a request are worth nothing."""
        self._write({"request": request, "forgotten": True})

    def repeats(self, request: str, void: Sequence[str] = ()) -> list[tuple[float, Any]]:
        """Return the repeats of a request that no answer has used; an answer that was refused has used none.

        Repeats from before one of the answers became void are left out.
        """
        refused = {line["sent"] for line in self._lines if line.get("refused")}
        found: list[tuple[float, Any]] = []
        for line in self._lines:
            if line.get("request") != request:
                continue
            if line.get("repeat") is not None:
                found += [(line["repeat"], line.get("readings"))] if line.get("void", []) == list(void) else []
            elif line.get("key") not in refused:
                found = []
        return found

    def answer(self, request: str, answer: dict[str, Any]) -> str:
        """Keep an answer, and return the idempotency key with which to send it."""
        key = uuid4().hex
        self._write({"request": request, "answer": answer, "key": key})
        return key

    def sent(self, key: str) -> None:
        """Note that the service has an answer, or does not want it any more."""
        self._write({"sent": key})

    def refused(self, key: str) -> None:
        """Note that an answer has a mistake, so that it is not sent again; its repeats may be in another."""
        self._write({"sent": key, "refused": True})

    def unsent(self) -> list[tuple[str, dict[str, Any], str]]:
        """Return the requests, answers and keys that the service may not have."""
        sent = {line["sent"] for line in self._lines if "sent" in line}
        kept = (line for line in self._lines if "answer" in line and line["key"] not in sent)
        return [(line["request"], line["answer"], line["key"]) for line in kept]

    def _write(self, line: dict[str, Any]) -> None:
        text = json.dumps(line, allow_nan=False)
        self._lines.append(line)
        if self._file is not None:
            self._file.write(text.encode() + b"\n")
            self._file.flush()
            os.fsync(self._file.fileno())


def _lines(content: bytes, aside: Path) -> Iterator[dict[str, Any]]:
    known = aside.read_bytes().splitlines() if aside.exists() else []
    for text in content.splitlines():
        try:
            if not _is_line(line := json.loads(text)):
                raise ValueError("it is neither a repeat, nor an answer, nor a note about one")
        except (ValueError, RecursionError) as error:
            if text and text not in known:
                log.error("a line of the journal cannot be used, and is copied to %s: %s", aside, error)
                with aside.open("ab") as file:
                    file.write(text + b"\n")
        else:
            yield line


def _is_line(line: Any) -> bool:  # noqa: ANN401 - JSON
    match line:
        case {"request": str(), "repeat": float() as value}:
            return isfinite(value)
        case {"request": str(), "answer": dict(), "key": str()} | {"request": str(), "forgotten": True}:
            return True
    return isinstance(line, dict) and isinstance(line.get("sent"), str)


PAUSE_S = 2.0
"""Pause after a request that the service could not serve."""

INVALID = 422
"""Status of an answer with a mistake, like too few values: what was measured is still good."""

ENDED = 409
"""Status of an answer to a request that is wanted no more. Any other refusal may come from a service without it."""


class Deliveries:
    """The answers of a driver, which is their operator."""

    def __init__(self, connection: Connection, journal: Journal, operator: str) -> None:
        self.journal = journal
        self._connection, self._operator = connection, operator

    def send_leftovers(self) -> None:
        """Send the answers that an earlier run left in the journal; one that is refused does not stop the others.

        Raises:
            ServiceError: the service refuses the token of the driver; the answers stay in the journal.
        """
        for request, answer, key in self.journal.unsent():
            try:
                self.deliver(request, answer, key)
            except ServiceError as error:
                if refuses_sender(error):
                    raise
                log.error("the answer %s in the journal, to request %s, is refused: %s", answer, request, error)

    def deliver(self, request: str, answer: dict[str, Any], key: str) -> AnswerRead:
        """Send a journalled answer until the service has it; it stays in the journal if the service never saw it.

        Raises:
            ServiceError: the service refuses it.
        """
        path = f"/requests/{segment(request)}/measurements"
        while True:
            try:
                given = self._connection.post(AnswerRead, path, answer | {"operator": self._operator}, key=key)
            except ServiceUnreachable as error:
                log.warning("not sent yet: %s", error)
                time.sleep(PAUSE_S)
            except ServiceError as error:
                if error.problem.status < 500 and error.problem.status != 429:
                    if is_of_gaplab(error) and error.problem.status == INVALID:
                        self.journal.refused(key)
                    elif is_of_gaplab(error) and error.problem.status == ENDED:
                        self.journal.sent(key)
                    raise
                log.warning("not taken yet: %s", error)
                time.sleep(PAUSE_S)
            else:
                self.journal.sent(key)
                return given
