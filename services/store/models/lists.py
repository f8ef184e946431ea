"""What people keep about lists: saved views, and what was deleted."""

from datetime import datetime

from sqlalchemy import String, Text
from sqlalchemy.orm import Mapped, mapped_column

from gaplab.services.store.models.base import Base


class DeletionRow(Base):
    """A deleted study or experiment; its events still refer to it.

    Attributes:
        id: its id, which nothing else has unless its archive is imported again; then this row is removed.
        study_id: study of a deleted experiment; NULL for a study, or an experiment without one.
        token_id: id of the token that deleted it; NULL without a token.
    """

    __tablename__ = "deletion"

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    study_id: Mapped[str | None] = mapped_column(String(32))
    name: Mapped[str] = mapped_column(String(200))
    token_id: Mapped[str | None] = mapped_column(String(32))
    deleted_at: Mapped[datetime]


class ViewRow(Base):
    """A saved view: a query with a name, which all callers share.

    Attributes:
        shows: `all`, `studies` or `experiments`.
        query: query of the list; NULL for all.
        sort: order of the list.
    """

    __tablename__ = "view"

    name: Mapped[str] = mapped_column(String(60), primary_key=True)
    shows: Mapped[str] = mapped_column(String(16))
    query: Mapped[str | None] = mapped_column(Text)
    sort: Mapped[str] = mapped_column(String(20))
    created_at: Mapped[datetime]
