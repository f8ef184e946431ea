"""Answers to requests that created something, by the key that their sender gave them."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, TypeAlias

from sqlalchemy import delete, select, update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from gaplab.services.store.clock import now
from gaplab.services.store.models import IdempotencyRow

_Insert: TypeAlias = Callable[..., postgresql.Insert | sqlite.Insert]
_INSERT: dict[str, _Insert] = {"sqlite": sqlite.insert, "postgresql": postgresql.insert}


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
    moment = session.execute(select(now())).scalar_one()
    insert = _INSERT[session.get_bind().dialect.name]
    values = {"caller": caller, "key": key, "digest": digest, "created_at": moment}
    taken = session.execute(
        insert(row).values(values).on_conflict_do_nothing(index_elements=[row.caller, row.key]).returning(row.key)
    ).first()
    if taken:
        return None
    known = session.execute(select(row.digest, row.answer).where(row.caller == caller, row.key == key)).one()
    return Answered(known.digest, known.answer or {})


def keep(session: Session, caller: str, key: str, answer: dict[str, Any]) -> None:
    """Store the answer of a key that this transaction took."""
    row = IdempotencyRow
    session.execute(update(row).where(row.caller == caller, row.key == key).values(answer=answer))


def forget(session: Session, older_than: timedelta) -> None:
    """Remove keys of longer ago."""
    before: datetime = session.execute(select(now())).scalar_one() - older_than
    session.execute(delete(IdempotencyRow).where(IdempotencyRow.created_at < before))
