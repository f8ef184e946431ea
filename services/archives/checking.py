"""The rows of an archive, checked value by value before they are stored."""

import json
from collections.abc import Iterator
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import IO, Annotated, Any, Literal, NoReturn

from pydantic import (
    AfterValidator,
    AwareDatetime,
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    StringConstraints,
    ValidationError,
    create_model,
)

from gaplab.schemas.base import Count, Priority
from gaplab.schemas.measurements import MOST_VALUES, Safety, Table
from gaplab.schemas.mistakes import sentence
from gaplab.schemas.provenance import Provenance
from gaplab.schemas.traces import Hash, TraceRead
from gaplab.services.archives.columns import ADDED, EXPERIMENT, Row, columns_of
from gaplab.services.core.errors import InvalidArchive, InvalidSpec
from gaplab.services.core.nesting import refuse_too_deep
from gaplab.services.store.tables import Column, Kind

LONGEST_LINE = 8 * 2**20
"""Most characters of one row."""

GREATEST, GREATEST_LARGE = 2**30, 2**48
"""Limits of whole numbers of 32 and 64 bits: far from overflow, since some continue to count or are added up."""

_ID = r"^[A-Za-z0-9]{1,64}$"
_IDS = {"id", "study_id", "experiment_id", EXPERIMENT}

_AS_READ: dict[tuple[str, str], Any] = {
    ("experiment", "precedence"): Priority,
    ("experiment", "max_parallel"): Annotated[Count, Field(le=10_000)],
    ("provenance", "facts"): Provenance,
    ("request", "safety"): Safety,
    ("answer", "values"): Annotated[list[FiniteFloat], Field(min_length=1, max_length=MOST_VALUES)],
    ("answer", "readings"): tuple[Table, ...],
    ("answer", "attachments"): tuple[Hash, ...],
    ("answer", "traces"): tuple[TraceRead, ...],
    ("answer", "doubts"): tuple[str, ...],
    ("branch", "steps"): tuple[dict[str, object], ...],
}
"""What later reads a column, if the database permits more. `consistency` checks specs, which may lack parameters."""

_Moment = Annotated[
    AwareDatetime,
    Field(ge=datetime(1970, 1, 1, tzinfo=UTC), lt=datetime(9000, 1, 1, tzinfo=UTC)),
    AfterValidator(lambda moment: moment.astimezone(UTC)),
]
_TYPES: dict[Kind, Any] = {
    Kind.REAL: FiniteFloat,
    Kind.TRUTH: bool,
    Kind.MOMENT: _Moment,
    Kind.VECTOR: list[FiniteFloat],
    Kind.READINGS: list[FiniteFloat | None],
    Kind.NESTED: dict[str, Any] | list[Any],
}


def checked(table: str, file: Path, count: int) -> Iterator[Row]:
    """Yield the rows of a table from its file, which has a row a line; the manifest states their number.

    Raises:
        InvalidArchive: a row or the number of rows is invalid; the message names the first invalid row and column.
    """
    model, number = _model(table), 0
    nested = [column.name for column in columns_of(table) if column.kind is Kind.NESTED]
    with file.open(encoding="ascii", errors="surrogateescape") as lines:
        for number, line in enumerate(_lines(lines, table), 1):
            if number > count:
                _refuse(table, f"has more than the {count} rows that the manifest states")
            place = f"{table}, row {number}"
            row = _row(line, place)
            if unknown := sorted(set(row) - set(model.model_fields)):
                _refuse(place, f"has columns that this version of gaplab does not know: {', '.join(unknown)[:200]}")
            try:
                found = model.model_validate_json(line)
            except ValidationError as error:
                _refuse(f"{place},", first_error(error))
            yield dict(found) | {name: row.get(name) for name in nested}
    if number != count:
        _refuse(table, f"has {number} rows; the manifest states {count}")


def first_error(error: ValidationError) -> str:
    """Return the place and the mistake of the first error, without the value."""
    first = error.errors(include_url=False, include_input=False)[0]
    return f"{'/'.join(map(str, first['loc']))[:100]}: {sentence(first)}"


def _lines(lines: IO[str], table: str) -> Iterator[str]:
    while line := lines.readline(LONGEST_LINE + 1):
        if len(line) > LONGEST_LINE:
            _refuse(table, f"has a row of more than {LONGEST_LINE:,} characters")
        yield line


def _row(line: str, place: str) -> Row:
    try:
        row = json.loads(line)
        text = json.dumps(row, ensure_ascii=False, allow_nan=False)  # fails for nan and infinity
        text.encode()  # fails for half of a surrogate pair
        refuse_too_deep(row)
    except InvalidSpec as error:
        _refuse(f"{place},", str(error)[:300])
    except (ValueError, RecursionError):
        _refuse(place, "is not JSON in ASCII, or has a number or a text that cannot be stored")
    if not isinstance(row, dict) or "\\u0000" in text:
        _refuse(place, "is not a JSON object, or has a NUL character")
    return row


@cache
def _model(table: str) -> type[BaseModel]:
    """Return the pydantic model of a row: every column is required but those added later, others are not permitted."""
    added = ADDED.get(table, frozenset())
    fields: dict[str, Any] = {
        column.name: (type_ | None if column.nullable else type_, None if column.name in added else ...)
        for column in columns_of(table)
        for type_ in [_AS_READ.get((table, column.name)) or _type(column)]
    }
    return create_model(table, __config__=ConfigDict(extra="forbid", strict=True), **fields)


def _type(column: Column) -> Any:  # noqa: ANN401 - a type, as pydantic takes it
    if column.kind is Kind.WHOLE:
        return Annotated[int, Field(ge=0, le=GREATEST_LARGE if column.large else GREATEST)]
    if column.choices:
        return Literal[column.choices]
    if column.kind is Kind.TEXT:
        return Annotated[
            str, StringConstraints(max_length=column.longest, pattern=_ID if column.name in _IDS else None)
        ]
    return _TYPES[column.kind]


def _refuse(place: str, what: str) -> NoReturn:
    raise InvalidArchive(f"{place} {what}")
