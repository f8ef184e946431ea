"""The columns of each table, described without SQLAlchemy: they follow from the models."""

from dataclasses import dataclass
from datetime import datetime
from functools import cache
from types import UnionType
from typing import Any, get_args, get_type_hints

from sqlalchemy import BigInteger, String
from sqlalchemy import Column as TableColumn

from gaplab.services.store.models import Base

LONGEST_TEXT = 100_000
"""Characters of a text for which the database itself has no limit, such as notes."""


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        type: type of its values, apart from null, as the model declares it.
        nullable: null is permitted.
        generated: the database itself numbers the rows.
        longest: most characters of a text; None if a longer one is cut when it is stored.
        large: a whole number of 64 bits, rather than 32.
        choices: the only permitted texts; empty if all are.
    """

    name: str
    type: Any
    nullable: bool
    generated: bool = False
    longest: int | None = None
    large: bool = False
    choices: tuple[str, ...] = ()


@cache
def columns_of(table: str) -> tuple[Column, ...]:
    """Return the columns of a table, in the order of the database."""
    columns = Base.metadata.tables[table].columns
    (model,) = (each.class_ for each in Base.registry.mappers if each.local_table is Base.metadata.tables[table])
    mapped = get_type_hints(model, {"datetime": datetime, "Any": Any})
    return tuple(_column(each, get_args(mapped[each.name])[0]) for each in columns)


def _column(column: TableColumn[Any], declared: Any) -> Column:  # noqa: ANN401 - a type
    choices = tuple(getattr(column.type, "enums", ()))
    return Column(
        name=column.name,
        type=get_args(declared)[0] if isinstance(declared, UnionType) else declared,
        nullable=bool(column.nullable),
        generated=column.table.autoincrement_column is column,
        longest=column.type.length or LONGEST_TEXT if isinstance(column.type, String) and not choices else None,
        large=isinstance(column.type, BigInteger),
        choices=choices,
    )
