"""The journal of a driver: what was measured is on its own disk before it is sent, and until the service has it."""

import json
import logging
import os
from collections.abc import Iterator, Sequence
from math import isfinite
from pathlib import Path
from typing import Any, Self
from uuid import uuid4

log = logging.getLogger("gaplab.driver")

PAUSE_S = 2.0
"""Pause after a request that the service could not serve."""


class Journal:
    """Lines of JSON in a file, each on disk when its method returns; without a file, they are in memory.

    A line is a repeat of a request, an answer with its idempotency key, or the note that the service has an answer. One
    that is none of these, as a power cut leaves, is logged once, and copied to a file beside it, `*.unreadable`.

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
        """Note that the repeats of a request are invalid."""
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

    def sent(self, key: str, *, refused: bool = False) -> None:
        """Note that an answer is not sent again: the service has it, or wants none, or refused it for a mistake.

        The repeats of one with a mistake may be in another.
        """
        self._write({"sent": key, "refused": refused})

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
