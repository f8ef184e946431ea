"""Notifications that are left to send or were sent, and the process whose turn it is to send them."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, Index, String
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.services.store.models.base import Base, Reason


class NotificationRow(Base):
    """A notification of an end to one channel.

    Attributes:
        event: number of the event that is the end.
        subject_id: id of the study or the experiment that has ended.
        channel: a `Channel`.
        experiment_id: experiment of the event.
        message: what is sent, but for the address of the page.
        attempts: number of attempts so far.
        next_at: time of the next attempt; NULL once it was delivered or given up.
        error: why the latest attempt failed.
    """

    __tablename__ = "notification"
    __table_args__ = (Index(None, "next_at", "event"),)

    event: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    subject_id: Mapped[str] = mapped_column(String(32), primary_key=True)
    channel: Mapped[str] = mapped_column(String(16), primary_key=True)
    experiment_id: Mapped[str] = mapped_column(String(32))
    message: Mapped[dict[str, Any]]
    attempts: Mapped[int] = mapped_column(default=0)
    next_at: Mapped[datetime | None]
    error: Mapped[str | None] = mapped_column(Reason)
    delivered_at: Mapped[datetime | None]


class NotifierRow(Base):
    """How far events were searched for ends, in a single row, and the process that does so.

    Attributes:
        after: number of the last event that was looked at; NULL before the first time.
        owner: process whose turn it is.
        until: time at which the turn may go to another one.
    """

    __tablename__ = "notifier"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    after: Mapped[int | None] = mapped_column(BigInteger)
    owner: Mapped[str | None] = mapped_column(String(200))
    until: Mapped[datetime | None]
