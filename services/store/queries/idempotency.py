"""Answers to requests that created something, by the key that their sender gave them."""

from dataclasses import dataclass
from datetime import timedelta
from typing import Any

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from gaplab.services.store.clock import moment
from gaplab.services.store.models import IdempotencyRow
from gaplab.services.store.statements import insert_new


@dataclass(frozen=True)
class Answered:
    """What a key stands for.

    Attributes:
        digest: of the request.
        answer: that it got.
    """

    digest: str
    answer: dict[str, Any]


def reserve(session: Session, caller: str, key: str, digest: str) -> Answered | None:
    """Take the key for this transaction, or say what it stands for already.

    Another transaction that has taken it is waited for: in Postgres by the unique key, in SQLite by the one writer.
    """
    row = IdempotencyRow
    values = {"caller": caller, "key": key, "digest": digest, "created_at": moment(session)}
    if session.execute(insert_new(session, row).values(values).returning(row.key)).first():
        return None
    known = session.execute(select(row.digest, row.answer).where(row.caller == caller, row.key == key)).one()
    return Answered(known.digest, known.answer or {})


def keep(session: Session, caller: str, key: str, answer: dict[str, Any]) -> None:
    """Store the answer of a key that this transaction took."""
    row = IdempotencyRow
    session.execute(update(row).where(row.caller == caller, row.key == key).values(answer=answer))


def forget(session: Session, older_than: timedelta) -> None:
    """Remove keys of longer ago."""
    session.execute(delete(IdempotencyRow).where(IdempotencyRow.created_at < moment(session) - older_than))
