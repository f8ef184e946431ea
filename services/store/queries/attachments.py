"""Attachments, and the answers that name them."""

from collections.abc import Collection
from datetime import timedelta
from itertools import chain

from sqlalchemy import ScalarSelect, delete, select

from gaplab.services.store.clock import moment
from gaplab.services.store.models import AnswerRow, AttachmentRow
from gaplab.services.store.session import Session

UNNAMED_LIVE = timedelta(days=7)
"""Time for which a file is kept at least before an answer names it."""


def present(session: Session, names: Collection[str]) -> set[str]:
    """Return the ids among `names` that are stored. They stay until the transaction has ended."""
    row = AttachmentRow
    return set(session.scalars(select(row.id).where(row.id.in_(names)).with_for_update(read=True, key_share=True)))


def named(session: Session, repetitions: ScalarSelect[int] | None = None) -> set[str]:
    """Return the ids that answers name: all answers, or the answers of some repetitions."""
    chosen = select(AnswerRow.attachments)
    if repetitions is not None:
        chosen = chosen.where(AnswerRow.repetition_id.in_(repetitions))
    return set(chain.from_iterable(each or () for each in session.scalars(chosen)))


def remove_unnamed(session: Session, once_named: Collection[str]) -> None:
    """Remove files that no answer names.

    A file that no answer has named yet is kept for `UNNAMED_LIVE`, since its answer may be on its way.

    Args:
        session: session of a transaction that writes.
        once_named: ids that deleted answers named.
    """
    row = AttachmentRow
    old = row.created_at < moment(session) - UNNAMED_LIVE
    unnamed = select(row.id).where(row.id.in_(once_named) | old).order_by(row.id).with_for_update()
    if candidates := set(session.scalars(unnamed)):
        for each in sorted(candidates - named(session)):
            session.execute(delete(row).where(row.id == each))
