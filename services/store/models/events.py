"""What happened, in order."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, Index, Integer, String
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.schemas.events import EventKind
from gaplab.services.store.clock import now
from gaplab.services.store.models.base import Base

NUMBER = BigInteger().with_variant(Integer, "sqlite")
"""In SQLite, an INTEGER primary key is the row's own number and needs no index of its own."""


class EventRow(Base):
    """One thing that happened to an experiment, written in the transaction that made it so.

    There is no foreign key to the experiment: on Postgres it would lock the experiment's row after the counter's, and
    a transaction that has locked the experiment waits for the counter.

    Attributes:
        number: without holes, in the order of commits.
        repetition: its number within the experiment.
        kind: one of `EventKind`; a later version has more.
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
    """The number of the latest event, in the only row, which a transaction with events locks until its commit."""

    __tablename__ = "event_counter"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    latest: Mapped[int] = mapped_column(BigInteger)
