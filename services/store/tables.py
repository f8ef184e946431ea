"""The columns of each table, described without SQLAlchemy: they follow from the models."""

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from functools import cache
from typing import Any, get_args, get_type_hints

from sqlalchemy import JSON, BigInteger, Boolean, Integer, LargeBinary, String
from sqlalchemy import Column as TableColumn

from gaplab.services.store.clock import UtcDateTime
from gaplab.services.store.models import Base, Number, Reason

LONGEST_TEXT = 100_000
"""Characters of a text for which the database itself has no limit, such as notes."""


class Kind(StrEnum):
    """The type of a column's values; readings are a vector in which numbers may be missing."""

    TEXT = "text"
    WHOLE = "whole"
    REAL = "real"
    TRUTH = "truth"
    MOMENT = "moment"
    VECTOR = "vector"
    READINGS = "readings"
    NESTED = "nested"
    BINARY = "binary"


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        nullable: null is permitted.
        generated: the database itself numbers the rows.
        longest: most characters of a text; None if a longer one is cut when it is stored.
        large: a whole number of 64 bits, rather than 32.
        choices: the only permitted texts; empty if all are.
    """

    name: str
    kind: Kind
    nullable: bool
    generated: bool = False
    longest: int | None = None
    large: bool = False
    choices: tuple[str, ...] = ()


@cache
def columns_of(table: str) -> tuple[Column, ...]:
    """Return the columns of a table, in the order of the database."""
    return tuple(_column(each) for each in Base.metadata.tables[table].columns)


def _column(column: TableColumn[Any]) -> Column:
    choices = tuple(getattr(column.type, "enums", ()))
    return Column(
        name=column.name,
        kind=_kind(column),
        nullable=bool(column.nullable),
        generated=column.table.autoincrement_column is column,
        longest=column.type.length or LONGEST_TEXT if isinstance(column.type, String) and not choices else None,
        large=isinstance(column.type, BigInteger),
        choices=choices,
    )


def _kind(column: TableColumn[Any]) -> Kind:
    kinds: dict[type, Kind] = {
        UtcDateTime: Kind.MOMENT,
        Boolean: Kind.TRUTH,
        Integer: Kind.WHOLE,
        Number: Kind.REAL,
        String: Kind.TEXT,
        Reason: Kind.TEXT,
        LargeBinary: Kind.BINARY,
        JSON: _kind_of_json(column),
    }
    return next(kind for type_, kind in kinds.items() if isinstance(column.type, type_))


def _kind_of_json(column: TableColumn[Any]) -> Kind:
    """Return whether the model declares the column as a list of numbers, with gaps or without."""
    (model,) = (each.class_ for each in Base.registry.mappers if each.local_table is column.table)
    (declared,) = get_args(get_type_hints(model, {"datetime": datetime, "Any": Any})[column.name])
    permitted = {declared, *get_args(declared)}
    if list[float] in permitted:
        return Kind.VECTOR
    return Kind.READINGS if list[float | None] in permitted else Kind.NESTED
