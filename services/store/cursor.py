"""Opaque cursors: the key of a page's last row, which a client sends back for the next page."""

import json
from base64 import urlsafe_b64decode, urlsafe_b64encode
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, Tuple, literal, tuple_
from sqlalchemy.orm import InstrumentedAttribute

from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.store.texts import storable

R = TypeVar("R")

Column = InstrumentedAttribute[Any] | ColumnElement[Any]

_LONGEST = 2_000
"""The name of an experiment may be part of a cursor."""


def encode(*key: str | int | datetime, bound_to: str = "") -> str:
    """Return the cursor of a key, valid only for the list that `bound_to` describes."""
    plain = [bound_to] + [part.isoformat() if isinstance(part, datetime) else part for part in key]
    return urlsafe_b64encode(json.dumps(plain, ensure_ascii=False).encode()).decode().rstrip("=")


def next_cursor(rows: Sequence[R], limit: int, cursor_of: Callable[[R], str]) -> str | None:
    """Return the cursor of the next page; `rows` has one row more than the page if a next page exists."""
    return cursor_of(rows[limit - 1]) if len(rows) > limit else None


def decode(cursor: str, columns: Sequence[Column], bound_to: str = "") -> Tuple:
    """Return the key of a cursor as SQL, to compare with the columns that it was encoded from.

    Raises:
        InvalidSpec: no page of this list gave the cursor; its pointer is `cursor`.
    """
    key = key_of(cursor, columns, bound_to)
    return tuple_(*(literal(part, column.type) for part, column in zip(key, columns, strict=True)))


def key_of(cursor: str, columns: Sequence[Column], bound_to: str = "") -> tuple[Any, ...]:
    """Return the key of a cursor.

    Raises:
        InvalidSpec: no page of this list gave the cursor; its pointer is `cursor`.
    """
    try:
        bound, *parts = json.loads(urlsafe_b64decode(cursor[:_LONGEST] + "=" * (-len(cursor) % 4)))
        if bound != bound_to:
            message = "this cursor belongs to a list with other filters or order; leave it out for the first page"
            raise InvalidSpec([Violation("cursor", cursor, message)])
        return tuple(_part(part, column) for part, column in zip(parts, columns, strict=True))
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        message = "this is not a cursor of this service; leave it out for the first page"
        raise InvalidSpec([Violation("cursor", cursor, message)]) from error


def _part(part: object, column: Column) -> object:
    kind = column.type.python_type
    value = datetime.fromisoformat(str(part)).astimezone(UTC) if kind is datetime else part
    if type(value) is not kind:
        raise TypeError(part)
    if (isinstance(value, int) and abs(value) >= 2**31) or (isinstance(value, str) and storable(value) != value):
        raise ValueError(part)
    return value
