"""Attachments, and the answers that name them."""

from collections.abc import Collection, Iterable, Sequence
from datetime import timedelta
from itertools import chain
from typing import Any

from sqlalchemy import ScalarSelect, delete, func, select

from gaplab.services.core.errors import Violation
from gaplab.services.store.clock import moment, now
from gaplab.services.store.models import AnswerRow, AttachmentRow
from gaplab.services.store.session import Session
from gaplab.services.store.statements import insert_new, wait_for_others

MOST_BYTES = 20_000_000
"""Largest attachment."""

UNNAMED_LIVE = timedelta(days=7)
"""Time for which a file is kept at least before an answer names it."""

_LOCK = 0x67617066  # among the advisory locks of a Postgres database


def present(session: Session, names: Collection[str]) -> set[str]:
    """Return the ids among `names` that are stored. They stay until the transaction has ended."""
    row = AttachmentRow
    return set(session.scalars(select(row.id).where(row.id.in_(names)).with_for_update(read=True, key_share=True)))


def missing(session: Session, names: Sequence[str], place: str) -> list[Violation]:
    """Return a violation for each of the ids, at `place` in a request, that is not stored."""
    stored = present(session, names)
    message = "no attachment with this hash is stored; send the file first"
    return [Violation(f"{place}/{at}", name, message) for at, name in enumerate(names) if name not in stored]


def all_ids(session: Session) -> set[str]:
    """Return the ids of all that are stored."""
    return set(session.scalars(select(AttachmentRow.id)))


def named(session: Session, repetitions: ScalarSelect[int] | None = None) -> set[str]:
    """Return the ids that answers name: all answers, or the answers of some repetitions."""
    chosen = select(AnswerRow.attachments)
    if repetitions is not None:
        chosen = chosen.where(AnswerRow.repetition_id.in_(repetitions))
    some_at_once = session.scalars(chosen, execution_options={"yield_per": 100})
    return set(chain.from_iterable(each or () for each in some_at_once))


def remove_unnamed(session: Session, once_named: Collection[str]) -> None:
    """Remove files that no answer names; `once_named` are those that deleted answers named.

    A file that no answer has named yet is kept for `UNNAMED_LIVE`, since its answer may be on its way.
    """
    row = AttachmentRow
    old = row.created_at < moment(session) - UNNAMED_LIVE
    unnamed = select(row.id).where(row.id.in_(once_named) | old).order_by(row.id).with_for_update()
    if candidates := set(session.scalars(unnamed)):
        for each in sorted(candidates - named(session)):
            session.execute(delete(row).where(row.id == each))


def content_of(session: Session, id_: str) -> bytes:
    """Return the content of a file that is stored."""
    return session.execute(select(AttachmentRow.content).where(AttachmentRow.id == id_)).scalar_one()


def insert_unless_there(session: Session, rows: Iterable[dict[str, Any]]) -> None:
    """Insert files with their contents.

    One that is there already stays as it is, and nobody can delete it before this transaction ends.
    """
    for row in rows:
        if not present(session, [row["id"]]):
            session.execute(insert_new(session, AttachmentRow).values({"created_at": now()} | row))


def unnamed_bytes(session: Session) -> int:
    """Return the size of all files that no answer names; a concurrent caller waits until this transaction ends."""
    wait_for_others(session, _LOCK)
    row = AttachmentRow
    sizes: dict[str, int] = dict(session.execute(select(row.id, func.length(row.content))).all())
    return sum(sizes[each] for each in sizes.keys() - named(session))
