"""The base of all tables, and their revision."""

from collections.abc import Sequence
from datetime import datetime
from enum import StrEnum
from typing import Any, ClassVar

from sqlalchemy import JSON, Dialect, Double, Enum, MetaData, Text, TypeDecorator
from sqlalchemy.orm import DeclarativeBase

from gaplab.schemas.lifecycle import Ending, State
from gaplab.schemas.measurements import AnswerState, RequestState
from gaplab.schemas.records import MeasurementKind
from gaplab.services.store.clock import UtcDateTime
from gaplab.services.store.texts import brief, storable

REVISION = "0007"
"""The revision with these tables; a database at any other revision is refused."""


def words(kind: type[StrEnum], name: str) -> Enum:
    """Return a text type that a named constraint limits to the values of an enumeration."""
    return Enum(
        kind,
        native_enum=False,
        create_constraint=True,
        length=16,
        name=name,
        values_callable=lambda members: [each.value for each in members],
    )


class Number(TypeDecorator[float]):
    """A double without negative zero, which SQLite does not keep: archives have the same bits from each database."""

    impl = Double
    cache_ok = True

    def process_bind_param(self, value: float | None, dialect: Dialect) -> float | None:  # noqa: ARG002
        """Replace -0.0 by 0.0."""
        return None if value is None else value + 0.0


class Reason(TypeDecorator[str]):
    """Why something failed, often in the words of a plug-in: stored without what exceeds a few lines."""

    impl = Text
    cache_ok = True

    def process_bind_param(self, value: str | None, dialect: Dialect) -> str | None:  # noqa: ARG002
        """Return the text as it is stored."""
        return None if value is None else brief(storable(value))


class Base(DeclarativeBase):
    """The base of all tables. Every constraint has a name, so that a migration can refer to it."""

    metadata = MetaData(
        naming_convention={
            "pk": "pk_%(table_name)s",
            "fk": "fk_%(table_name)s_%(column_0_N_name)s_%(referred_table_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
        }
    )
    type_annotation_map: ClassVar[dict[Any, Any]] = {
        datetime: UtcDateTime(),
        float: Number(),
        list[float]: JSON(none_as_null=True),
        list[float | None]: JSON(none_as_null=True),
        list[dict[str, Any]]: JSON(none_as_null=True),
        list[str]: JSON(none_as_null=True),
        list[list[list[float | None]]]: JSON(none_as_null=True),
        dict[str, Any]: JSON(none_as_null=True),
        State: Enum(State, native_enum=False, create_constraint=True, length=16, name="state"),
        MeasurementKind: words(MeasurementKind, "kind"),
        Ending: words(Ending, "ending"),
        RequestState: words(RequestState, "state"),
        AnswerState: words(AnswerState, "state"),
    }


def is_later(found: Sequence[str]) -> bool:
    """Return whether a database at these revisions is of a later version of gaplab."""
    return bool(found) and all(revision > REVISION for revision in found)


def other_schema(found: Sequence[str]) -> str:
    """Return the sentence about a database at other revisions than this version's, with what to do."""
    what = "use the version of gaplab that it is of" if is_later(found) else "run `python -m migrations`"
    return f"the database is at revision {', '.join(found) or 'none'}, this version needs {REVISION}: {what}"
