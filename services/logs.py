"""Logs of every process of the service: readable lines in a terminal, JSON lines anywhere else.

A record names its experiment and repetition by `extra=`. Anything that looks like a token, a password or an
Authorization header is removed from messages and tracebacks, and so are the details of Postgres, which quote rows.
"""

import json
import logging
import re
import sys
from collections import Counter
from collections.abc import Callable
from datetime import UTC, datetime
from time import monotonic
from typing import Any, TextIO

HIDDEN = "…"

_NAME = r"(?<![\w-])(?=[\w-]*(?:token|password|passwd|secret|api_?key))[\w-]*+"
"""A pattern that starts only at words and takes whole words: an address may be one very long word."""

_AFTER_DETAIL = r"\n[ |+]*(?:\[SQL: |\(Background on this error|\n[ |+]*(?:The above exception|During handling of) )"
"""What comes after the error of Postgres in a traceback; its details quote rows, over several lines."""

_SECRETS = (
    (re.compile(r"(?i)\bgaplab_[a-z0-9]{1,32}_[0-9a-f]{8,}"), f"gaplab_{HIDDEN}"),
    (re.compile(r"(?i)(authorization\W{1,6})(?:(?:bearer|basic|token)\s+)?[^\s'\",;)}\]]+"), rf"\1{HIDDEN}"),
    (re.compile(r"(?i)\b(bearer|basic)\s+[\w.~+/=-]{6,}"), rf"\1 {HIDDEN}"),
    (re.compile(rf"(?i)({_NAME}['\"]?\s?[=:]\s?['\"]?)[^\s&'\",;)}}\]]+"), rf"\1{HIDDEN}"),
    (re.compile(r"(://[^:/@\s]*):[^/\s]*@"), rf"\1:{HIDDEN}@"),
    (re.compile(rf"(?s)DETAIL:\s.*?(?={_AFTER_DETAIL}|\Z)"), f"DETAIL: {HIDDEN}"),
)

_PLACE = ("study", "experiment", "repetition")
_REQUEST = ("method", "path", "status")

_ACCESS = "uvicorn.access"
_REPEATING, _MOST_ALIKE, _WINDOW_S = {"asyncio", "uvicorn.error"}, 5, 60.0
_LONGEST = 1_000_000
_PROBES = {"/livez", "/readyz", "/metrics"}
_SUBJECT = re.compile(r"^/(?:studies/(?P<study>[\w-]{1,64})|experiments/(?P<experiment>[\w-]{1,64}))")


def configure(stream: TextIO | None = None) -> None:
    """Log to the stream, or to standard error: readable lines on a terminal, else JSON."""
    target = stream or sys.stderr
    handler = logging.StreamHandler(target)
    handler.setFormatter(Readable() if target.isatty() else Json())
    handler.addFilter(_rewrite_requests)
    handler.addFilter(Repeats())
    logging.basicConfig(level=logging.INFO, handlers=[handler], force=True)
    for noisy in ("alembic", "uvicorn.error", "httpx", "httpx2", "asyncio", "matplotlib", "fontTools"):
        logging.getLogger(noisy).setLevel(logging.WARNING)


def adopt(name: str) -> None:
    """Make a library with its own log handlers log like the rest, and only warnings."""
    logger = logging.getLogger(name)
    logger.handlers.clear()
    logger.propagate = True
    logger.setLevel(logging.WARNING)


def without_secrets(text: str) -> str:
    """Return the text without what looks like a secret; a very long text is cut, which would take minutes to search."""
    if len(text) > _LONGEST:
        text = f"{text[:_LONGEST]}… ({len(text) - _LONGEST:,} more characters were not logged)"
    for pattern, replacement in _SECRETS:
        text = pattern.sub(replacement, text)
    return text


class Repeats(logging.Filter):
    """Drops repeated records of the libraries that serve requests: clients could fill the disk with them."""

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        super().__init__()
        self._clock = clock
        self._began = clock()
        self._seen: Counter[str] = Counter()
        self._dropped: Counter[str] = Counter()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether to log the record; the first one of the next minute says how many were dropped."""
        if record.name not in _REPEATING:
            return True
        if self._clock() - self._began >= _WINDOW_S:
            self._began = self._clock()
            self._dropped, self._seen = self._seen - Counter(dict.fromkeys(self._seen, _MOST_ALIKE)), Counter()
        kind = f"{record.name}: {str(record.msg).partition(chr(10))[0]}"
        self._seen[kind] += 1
        if dropped := self._dropped.pop(kind, 0):
            record.msg, record.args = f"{record.getMessage()} ({dropped} more like this were not logged)", ()
        return self._seen[kind] <= _MOST_ALIKE


class Readable(logging.Formatter):
    """A readable line: time, level, logger, experiment and repetition, message."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the record as a line, and its traceback below."""
        when = datetime.fromtimestamp(record.created).astimezone().strftime("%H:%M:%S")
        place = "/".join(str(value) for name in _PLACE if (value := getattr(record, name, None)) is not None)
        line = f"{when} {record.levelname:<7} {record.name}{f' {place}' if place else ''}: {record.getMessage()}"
        trace = f"\n{self.formatException(record.exc_info)}" if record.exc_info else ""
        return without_secrets(line + trace)


class Json(logging.Formatter):
    """A JSON object a line: at, level, logger, message.

    Where they are known it has study, experiment, repetition, request and exception.
    """

    def format(self, record: logging.LogRecord) -> str:
        """Return the record as one line."""
        found: dict[str, Any] = {
            "at": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": without_secrets(record.getMessage()),
        }
        known = {name: getattr(record, name, None) for name in (*_PLACE, *_REQUEST)}
        found |= {
            name: without_secrets(value) if isinstance(value, str) else value
            for name, value in known.items()
            if value is not None
        }
        if record.exc_info:
            found["exception"] = without_secrets(self.formatException(record.exc_info))
        return json.dumps(found, ensure_ascii=False, default=str)


def _rewrite_requests(record: logging.LogRecord) -> bool:
    """Rewrite records of Uvicorn's access log: parts by name, no query, and no successful probe or asset."""
    if record.name != _ACCESS or not isinstance(record.args, tuple) or len(record.args) != 5:
        return True
    client, method, target, _, status = record.args
    path = str(target).partition("?")[0]
    if (path in _PROBES and status == 200) or (path.startswith("/assets/") and status in {200, 304}):
        return False
    record.msg, record.args = "%s %s %s from %s", (method, path, status, client)
    record.method, record.path, record.status = method, path, status
    if found := _SUBJECT.match(path):
        record.__dict__.update(found.groupdict())
    return True
