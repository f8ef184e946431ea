"""Time in the database: UTC in microseconds, by the database's own clock."""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import DateTime, Dialect, select
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.orm import Session
from sqlalchemy.sql.functions import FunctionElement
from sqlalchemy.types import TypeDecorator


class UtcDateTime(TypeDecorator[datetime]):
    """A time in UTC; Python gets it with its time zone from every database, although SQLite has no time zones."""

    impl = DateTime(timezone=True)
    cache_ok = True

    @property
    def python_type(self) -> type[datetime]:
        """Type of the values in Python."""
        return datetime

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:  # noqa: ARG002  # the base's signature
        """Refuse a time without a time zone, which is ambiguous."""
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"a time needs a time zone: {value!r} has none")
        return value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:  # noqa: ARG002  # the base's signature
        """Return the time in UTC."""
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class now(FunctionElement[datetime]):  # noqa: N801  # reads as the SQL function that it is
    """SQL function for the time by the database's clock, which is the same for all hosts; leases need that."""

    type = UtcDateTime()
    inherit_cache = True


@compiles(now, "sqlite")
def _now_of_sqlite(element: now, compiler: Any, **options: Any) -> str:  # noqa: ANN401, ARG001  # SQLAlchemy's hook
    return "(strftime('%Y-%m-%d %H:%M:%f', 'now') || '000')"


@compiles(now, "postgresql")
def _now_of_postgres(element: now, compiler: Any, **options: Any) -> str:  # noqa: ANN401, ARG001  # SQLAlchemy's hook
    return "clock_timestamp()"


def moment(session: Session) -> datetime:
    """Return the time by the database's clock."""
    found: datetime = session.execute(select(now())).scalar_one()
    return found
