"""Events of experiments, in commit order."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, Index, Integer, String
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.schemas.events import EventKind
from gaplab.services.store.clock import now
from gaplab.services.store.models.base import Base

NUMBER = BigInteger().with_variant(Integer, "sqlite")
"""Type of the key: in SQLite, an INTEGER primary key is the row number, and needs no index."""


class EventRow(Base):
    """An event of an experiment, written in the transaction that causes it.

    There is no foreign key to the experiment: on Postgres it would lock the experiment's row after the counter's, and
    a transaction that has locked the experiment waits for the counter.

    Attributes:
        number: number without gaps, in commit order.
        repetition: number of the repetition within the experiment.
        kind: one of `EventKind`, or a kind of a later version.
    """

    __tablename__ = "event"
    __table_args__ = (Index(None, "experiment_id", "number"),)

    number: Mapped[int] = mapped_column(NUMBER, primary_key=True, autoincrement=False)
    experiment_id: Mapped[str] = mapped_column(String(32))
    repetition: Mapped[int | None]
    kind: Mapped[EventKind] = mapped_column(String(32))
    body: Mapped[dict[str, Any]]
    at: Mapped[datetime] = mapped_column(default=now())


class EventCounterRow(Base):
    """The number of the latest event, in a single row; a transaction with events locks it until the commit."""

    __tablename__ = "event_counter"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    latest: Mapped[int] = mapped_column(BigInteger)
