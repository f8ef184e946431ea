"""Rows of an archive, value by value: what this lets through can be stored, shown and computed with."""

import json
import re
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from math import isfinite
from pathlib import Path
from typing import IO, Any, NoReturn

from gaplab.services.core.errors import InvalidArchive
from gaplab.services.store.archive_columns import EXPERIMENT, Column, Kind, columns_of

Row = dict[str, Any]

LONGEST_LINE = 8 * 2**20
"""Characters of one row."""

_ID = re.compile(r"[A-Za-z0-9]{1,32}")
_IDS = {"id", "study_id", "experiment_id", EXPERIMENT}


def checked(table: str, file: Path, count: int) -> Iterator[Row]:
    """The rows of a table, each checked; as many as there should be.

    Raises:
        InvalidArchive: with the first row and column that cannot be.
    """
    columns = {each.name: each for each in columns_of(table)}
    present: tuple[str, ...] | None = None
    number = 0
    with file.open(encoding="ascii", errors="surrogateescape") as lines:
        for number, line in enumerate(_lines(lines, table), 1):
            row = _row(line, f"{table}, row {number}")
            if present is None:
                present = _present(row, columns, table)
            if tuple(row) != present:
                _refuse(f"{table}, row {number}", "has other columns than the first")
            yield {name: _value(columns[name], value, f"{table}, row {number}") for name, value in row.items()}
    if number != count:
        _refuse(table, f"has {number} rows; the manifest says {count}")


def _lines(lines: IO[str], table: str) -> Iterator[str]:
    while line := lines.readline(LONGEST_LINE + 1):
        if len(line) > LONGEST_LINE:
            _refuse(table, f"has a row of more than {LONGEST_LINE:,} characters")
        yield line


def _row(line: str, place: str) -> Row:
    try:
        row = json.loads(line, parse_constant=_no_number)
        text = json.dumps(row, ensure_ascii=False, allow_nan=False)
        text.encode()  # half a surrogate pair is no text
    except (ValueError, RecursionError):
        _refuse(place, "is not JSON, in ASCII, or has a number or a text that is none")
    if not isinstance(row, dict) or "\\u0000" in text:
        _refuse(place, "is no JSON object, or has a NUL")
    return row


def _no_number(constant: str) -> NoReturn:
    raise ValueError(constant)


def _present(row: Row, columns: dict[str, Column], table: str) -> tuple[str, ...]:
    """The columns of all rows: ours, and every one that has no default."""
    if unknown := set(row) - set(columns):
        _refuse(table, f"has columns that this version does not know: {', '.join(sorted(unknown))[:200]}")
    if missing := [each.name for each in columns.values() if each.required and each.name not in row]:
        _refuse(table, f"lacks {', '.join(missing)}")
    return tuple(row)


def _value(column: Column, value: object, place: str) -> Any:  # noqa: ANN401 - as the column has it
    if value is None:
        if not column.nullable:
            _refuse(f"{place}, {column.name}", "is null")
        return None
    try:
        return _READERS[column.kind](column, value)
    except (ValueError, TypeError, OverflowError) as error:
        _refuse(f"{place}, {column.name}", str(error)[:200])


def _text(column: Column, value: object) -> str:
    if not isinstance(value, str):
        raise TypeError("is no text")
    if column.choices and value not in column.choices:
        msg = f"is {value[:32]!r}; it may be {', '.join(column.choices)}"
        raise ValueError(msg)
    if column.longest is not None and len(value) > column.longest:
        msg = f"has {len(value)} characters; {column.longest} are permitted"
        raise ValueError(msg)
    if column.name in _IDS and not _ID.fullmatch(value):
        msg = f"is {value!r}, which is no id"
        raise ValueError(msg)
    return value


def _whole(column: Column, value: object) -> int:
    if type(value) is not int or not column.least <= value <= column.greatest:
        msg = f"is no whole number from {column.least} to {column.greatest}"
        raise ValueError(msg)
    return value


def _real(_: Column, value: object) -> float:
    if type(value) not in {int, float} or not isfinite(number := float(value)):  # type: ignore[arg-type]
        raise ValueError("is no finite number")
    return number


def _truth(_: Column, value: object) -> bool:
    if type(value) is not bool:
        raise TypeError("is neither true nor false")
    return value


def _moment(_: Column, value: object) -> datetime:
    moment = datetime.fromisoformat(str(value))
    if moment.tzinfo is None or not 1970 <= moment.year <= 9000:
        raise ValueError("is no moment with a time zone, after 1970")
    return moment.astimezone(UTC)


def _vector(column: Column, value: object) -> list[float]:
    if not isinstance(value, list):
        raise TypeError("is no list of numbers")
    return [_real(column, each) for each in value]


def _nested(_: Column, value: object) -> object:
    if not isinstance(value, dict | list):
        raise TypeError("is neither an object nor a list")
    return value


_READERS: dict[Kind, Callable[[Column, object], Any]] = {
    Kind.TEXT: _text,
    Kind.WHOLE: _whole,
    Kind.REAL: _real,
    Kind.TRUTH: _truth,
    Kind.MOMENT: _moment,
    Kind.VECTOR: _vector,
    Kind.NESTED: _nested,
}


def _refuse(place: str, what: str) -> NoReturn:
    msg = f"{place} {what}" if what.startswith(("has", "lacks", "is")) else f"{place}: {what}"
    raise InvalidArchive(msg)
