"""What is of one service, and what its experiments share: provenances and robots."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, ForeignKey, Index, Integer, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.schemas.access import Role
from gaplab.schemas.events import EventKind
from gaplab.schemas.robots import FileKind
from gaplab.services.store.clock import now
from gaplab.services.store.models.base import Base, Reason, words
from gaplab.services.world.pools import MOST_BYTES


class TokenRow(Base):
    """A token; its secret is not stored.

    Attributes:
        id: the public part of the token, by which it is found, listed and revoked.
        digest: SHA-256 of the secret part, in hexadecimal.
        last_used_at: time of the last use, to the minute.
        revoked_at: time since which it is invalid; the row stays, so revoking the last token does not open the service.
    """

    __tablename__ = "token"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(200))
    role: Mapped[Role] = mapped_column(words(Role, "role"))
    digest: Mapped[str] = mapped_column(String(64))
    created_at: Mapped[datetime]
    last_used_at: Mapped[datetime | None]
    revoked_at: Mapped[datetime | None]


class IdempotencyRow(Base):
    """A request that created something under an idempotency key, with its answer.

    Attributes:
        caller: id of the sender's token; empty if no token is required. Keys of different callers are independent.
        digest: SHA-256 of the endpoint and the body.
        answer: answer as it was sent; NULL only within the transaction that computes it.
    """

    __tablename__ = "idempotency"
    __table_args__ = (Index(None, "created_at"),)

    caller: Mapped[str] = mapped_column(String(32), primary_key=True)
    key: Mapped[str] = mapped_column(String(255), primary_key=True)
    digest: Mapped[str] = mapped_column(String(64))
    answer: Mapped[dict[str, Any] | None]
    created_at: Mapped[datetime]


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


class NotificationRow(Base):
    """A notification of an end to one channel.

    Attributes:
        event: number of the event that is the end.
        subject_id: id of the study that has ended.
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


class ViewRow(Base):
    """A saved view: a query with a name, which all callers share.

    Attributes:
        query: query of the list; NULL for all.
        sort: order of the list.
    """

    __tablename__ = "view"

    name: Mapped[str] = mapped_column(String(60), primary_key=True)
    query: Mapped[str | None] = mapped_column(Text)
    sort: Mapped[str] = mapped_column(String(20))
    created_at: Mapped[datetime]


class ProvenanceRow(Base):
    """One distinct provenance; its id is a hash of its facts."""

    __tablename__ = "provenance"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    facts: Mapped[dict[str, Any]]
    created_at: Mapped[datetime] = mapped_column(default=now())


class ExperimentProvenanceRow(Base):
    """A provenance that computed an experiment, and the time of the first claim under it."""

    __tablename__ = "experiment_provenance"

    experiment_id: Mapped[str] = mapped_column(ForeignKey("experiment.id"), primary_key=True)
    provenance_id: Mapped[str] = mapped_column(ForeignKey("provenance.id"), primary_key=True)
    since: Mapped[datetime] = mapped_column(default=now())


class SupervisorRow(Base):
    """A supervisor that works, or that ended without saying so."""

    __tablename__ = "supervisor"

    owner: Mapped[str] = mapped_column(String(200), primary_key=True)
    started_at: Mapped[datetime] = mapped_column(default=now())
    heartbeat_at: Mapped[datetime] = mapped_column(default=now())


class FileRow(Base):
    """A robot file or a pool; it never changes, and specs name it by its hash.

    Attributes:
        sha256: of the canonical text, in hexadecimal.
        kind: what it is.
        name: of several files of a kind with one name, the newest is meant by it.
        text: canonical text of the file.
    """

    __tablename__ = "file"
    __table_args__ = (Index(None, "kind", "name", "created_at"),)

    sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    kind: Mapped[FileKind] = mapped_column(words(FileKind, "kind"))
    name: Mapped[str] = mapped_column(String(60))
    text: Mapped[str] = mapped_column(String(MOST_BYTES))
    created_at: Mapped[datetime] = mapped_column(default=now())
