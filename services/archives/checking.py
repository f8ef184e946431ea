"""The rows of an archive, checked value by value before they are stored."""

import json
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import cache
from typing import Annotated, Any, Literal, NoReturn

from pydantic import (
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
from gaplab.services.archives.columns import EXPERIMENT, Row, columns_of
from gaplab.services.core.errors import InvalidArchive, InvalidSpec
from gaplab.services.nesting import refuse_too_deep
from gaplab.services.store.queries.archives import Unreadable
from gaplab.services.store.tables import Column, Kind

GREATEST, GREATEST_LARGE = 2**30, 2**48
"""Limits of whole numbers of 32 and 64 bits: far from overflow, since some continue to count or are added up."""

_ID = r"^[A-Za-z0-9]{1,64}$"
_IDS = {"id", "study_id", "experiment_id", EXPERIMENT}

_Readings = list[FiniteFloat | None]


class _Checked(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class _Simulator(_Checked):
    parameters: list[FiniteFloat]
    squared_error: FiniteFloat | None
    lower: list[FiniteFloat] = []
    upper: list[FiniteFloat] = []
    weight: FiniteFloat = 0.0
    held_out_error: FiniteFloat = 0.0
    fit: _Readings = []


class _Body(_Checked):
    genome: list[FiniteFloat] = []
    readings: _Readings = []
    repeats: list[FiniteFloat] = []
    simulators: list[_Simulator] = []


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
    ("step", "body"): _Body,
}
"""What later reads a column, if the database permits more. `consistency` checks specs, which may lack parameters."""

_Moment = Annotated[AwareDatetime, Field(ge=datetime(1970, 1, 1, tzinfo=UTC), lt=datetime(9000, 1, 1, tzinfo=UTC))]
_TYPES: dict[Kind, Any] = {
    Kind.REAL: FiniteFloat,
    Kind.TRUTH: bool,
    Kind.MOMENT: _Moment,
    Kind.VECTOR: list[FiniteFloat],
    Kind.READINGS: _Readings,
    Kind.NESTED: dict[str, Any] | list[Any],
}


def checked(table: str, rows: Iterable[Row]) -> Iterator[Row]:
    """Yield the rows of a table, each as it was read.

    Raises:
        InvalidArchive: a row is invalid; the message names the first invalid row and column.
    """
    model, number, incoming = _model(table), 0, iter(rows)
    while True:
        number += 1
        place = f"{table}, row {number}"
        with readable(place):
            row = next(incoming, None)
        if row is None:
            return
        try:
            model.model_validate_json(_json(row, place))
        except ValidationError as error:
            _refuse(f"{place},", first_error(error))
        yield row


@contextmanager
def readable(place: str) -> Iterator[None]:
    """Name the place of a value that SQLAlchemy cannot read as its column's type.

    Raises:
        InvalidArchive: it has one.
    """
    try:
        yield
    except Unreadable as error:
        said = str(error).partition("\n")[0]
        raise InvalidArchive(f"{place} has a value that its column does not permit: {said}"[:300]) from error


def first_error(error: ValidationError) -> str:
    """Return the place and the mistake of the first error, without the value."""
    first = error.errors(include_url=False, include_input=False)[0]
    return f"{'/'.join(map(str, first['loc']))[:100]}: {sentence(first)}"


def _json(row: Row, place: str) -> str:
    try:
        text = json.dumps(row, default=_plain, ensure_ascii=False, allow_nan=False)  # fails for nan and infinity
        text.encode()  # fails for half of a surrogate pair
        refuse_too_deep(row)
    except InvalidSpec as error:
        _refuse(f"{place},", str(error)[:300])
    except (ValueError, TypeError, RecursionError):
        _refuse(place, "has a number, a text or bytes that JSON has not")
    if "\\u0000" in text:
        _refuse(place, "has a NUL character")
    return text


def _plain(value: object) -> str:
    if isinstance(value, datetime):
        return value.astimezone(UTC).isoformat()
    raise TypeError(f"an archive cannot hold a {type(value).__name__}")


@cache
def _model(table: str) -> type[BaseModel]:
    """Return the pydantic model of a row: every column is required, others are not permitted."""
    fields: dict[str, Any] = {
        column.name: (type_ | None if column.nullable else type_, ...)
        for column in columns_of(table)
        if column.kind is not Kind.BINARY
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
