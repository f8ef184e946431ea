"""Tables as an archive has them: which, and in what columns, whatever database they are in.

Here is the one list of tables: each is exported, or left out for a reason. What a table's columns are follows from the
models, so that a column which is added to an exported table is in the archives from then on.

What means something in one database only has no place in an archive: numbers that a database gave out are replaced by
what they stand for, leases are left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from functools import cache
from typing import Any, get_args, get_type_hints

from sqlalchemy import JSON, BigInteger, Boolean, Integer, String, Table
from sqlalchemy import Column as TableColumn
from sqlalchemy.orm import Mapper

from gaplab.services.store.clock import UtcDateTime
from gaplab.services.store.models import Base, Number

EXPORTED = (
    "provenance",
    "study",
    "experiment",
    "experiment_provenance",
    "repetition",
    "iteration",
    "measurement",
    "simulator",
    "attempt",
)
"""Each after those that it refers to: the order in which they are read back."""

LEFT_OUT: Mapping[str, str] = {
    "sensitivity": "follows from what is tuned, and is shared by all experiments that tune the same",
    "event": "is numbered without holes in one database, in which it happened",
    "event_counter": "counts the events of one database",
    "supervisor": "is a process of one service",
    "token": "is a secret of one service",
    "idempotency": "is of requests to one service",
    "checkpoint": "is a part of a step that is under way, and of use to whoever goes on with it",
}
"""With the reason."""

COLUMNS_LEFT_OUT: Mapping[tuple[str, str], str] = {
    ("experiment", "token_id"): "names a token of one service",
    ("experiment", "sensitivity_id"): "names a check of one service",
    ("experiment", "running"): "counts leases, which nobody holds in an archive",
    ("experiment", "claimable"): "follows from the states of repetitions",
    ("repetition", "checkpoints"): "counts checkpoints, which are left out",
    ("repetition", "owner"): "names a machine and a process there",
    ("repetition", "heartbeat_at"): "is of a lease, which nobody holds in an archive",
}
"""Of exported tables, with the reason."""

SIGNED = {("experiment", "precedence")}
"""The whole numbers that may be negative; all others count something."""

EXPERIMENT, REPETITION = "experiment", "repetition"
"""In place of the number that a database gave to a repetition: whose it is, and its number there."""


class Kind(StrEnum):
    """What the values of a column are."""

    TEXT = "text"
    WHOLE = "whole"
    REAL = "real"
    TRUTH = "truth"
    MOMENT = "moment"
    VECTOR = "vector"
    NESTED = "nested"


@dataclass(frozen=True)
class Column:
    """A column of an archive.

    Attributes:
        required: a row without it cannot be stored: it has no default.
        nullable: it may be null.
        longest: characters of a text; None for any number of them.
        least, greatest: of whole numbers; half of what a database has room for, since some of them go on to count.
        choices: the only permitted texts, if there are such.
    """

    name: str
    kind: Kind
    required: bool
    nullable: bool = False
    longest: int | None = None
    least: int = 0
    greatest: int = 2**30
    choices: tuple[str, ...] = ()


MOST = 2**48
"""The greatest of a large whole number: ten thousand of them add up within 64 bits."""


def table_of(name: str) -> Table:
    """The table of that name."""
    return Base.metadata.tables[name]


@cache
def columns_of(name: str) -> tuple[Column, ...]:
    """The columns that the archive has of the table of that name."""
    found: list[Column] = []
    for each in table_of(name).columns:
        if each.name == "repetition_id":
            needed, null = not each.nullable, bool(each.nullable)
            found += [Column(EXPERIMENT, Kind.TEXT, needed, null, 32), Column(REPETITION, Kind.WHOLE, needed, null)]
        elif not (given_out(each) or (name, each.name) in COLUMNS_LEFT_OUT or _refers_outside(each)):
            found.append(_column(name, each))
    return tuple(found)


def is_nested(name: str) -> bool:
    """Whether rows of the table have nested values, which suit JSON and not Parquet."""
    return any(each.kind is Kind.NESTED for each in columns_of(name)) or name == "study"


def given_out(column: TableColumn[Any]) -> bool:
    """Whether it is a number that the database itself gives to each row."""
    return column.table.autoincrement_column is column


def _refers_outside(column: TableColumn[Any]) -> bool:
    return any(key.column.table.name not in EXPORTED for key in column.foreign_keys)


def _column(table: str, column: TableColumn[Any]) -> Column:
    required = not column.nullable and column.default is None and column.server_default is None
    kind = _kind(table, column)
    choices = tuple(getattr(column.type, "enums", ()))
    longest = column.type.length if isinstance(column.type, String) and not choices else None
    greatest = MOST if isinstance(column.type, BigInteger) else Column.greatest
    least = -greatest if (table, column.name) in SIGNED else 0
    return Column(column.name, kind, required, bool(column.nullable), longest, least, greatest, choices)


def _kind(table: str, column: TableColumn[Any]) -> Kind:
    kinds: tuple[tuple[type, Kind], ...] = (
        (UtcDateTime, Kind.MOMENT),
        (Boolean, Kind.TRUTH),
        (Integer, Kind.WHOLE),
        (Number, Kind.REAL),
        (String, Kind.TEXT),
    )
    if isinstance(column.type, JSON):
        return Kind.VECTOR if _is_vector(table, column.name) else Kind.NESTED
    for type_, kind in kinds:
        if isinstance(column.type, type_):
            return kind
    msg = f"no archive has a place for {table}.{column.name}, a {column.type}"
    raise TypeError(msg)


def _is_vector(table: str, column: str) -> bool:
    """Whether the model says that it is a list of numbers."""
    (declared,) = get_args(get_type_hints(_model(table), _names())[column])
    return declared == list[float] or list[float] in get_args(declared)


def _names() -> dict[str, Any]:
    return {"datetime": datetime, "Any": Any}


@cache
def _model(table: str) -> type[Base]:
    mappers: Any = Base.registry.mappers
    return next(each.class_ for each in mappers if isinstance(each, Mapper) and each.local_table is table_of(table))
