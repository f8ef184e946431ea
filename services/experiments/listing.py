"""Lists of experiments and studies, page by page, filtered and sorted. Use cases raise StoreUnavailable.

A page begins after the key of the last row of the page before. The key is the sorted column, then the id. If a row's
state or name changes between two pages, both pages or neither may have it.
"""

import json
from dataclasses import asdict, dataclass
from hashlib import sha256
from typing import TypeVar

from sqlalchemy import Select, String, select, tuple_, type_coerce

from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import ExperimentRead, Page, StudyRead
from gaplab.services.experiments.query.conditions import (
    EXPERIMENT_TEXTS,
    STUDY_TEXTS,
    contains,
    experiments_meeting,
    of_study,
    studies_meeting,
    study_is,
)
from gaplab.services.experiments.views import view_experiments, view_studies
from gaplab.services.store.cursor import decode, encode, next_cursor
from gaplab.services.store.models import Base, ExperimentRow, StudyRow
from gaplab.services.store.session import Session, snapshot
from gaplab.services.store.statements import storable

R = TypeVar("R", ExperimentRow, StudyRow)


@dataclass(frozen=True)
class ListFilter:
    """The selection and the order of a list.

    Attributes:
        study: only experiments of this study.
        alone: only experiments without a study.
        state: only experiments or studies in this state.
        strategy: only experiments with this strategy, or studies that have such an experiment.
        text: only experiments or studies whose name, id, notes or tags contain this text.
        q: query, as `gaplab.services.experiments.query` has it. Archived ones are left out unless it mentions them, or
            a study is named.
        sort: an order of ORDERS; a minus before it reverses the order.
    """

    study: str | None = None
    alone: bool = False
    state: State | None = None
    strategy: str | None = None
    text: str | None = None
    q: str | None = None
    sort: str = "-created_at"

    def digest(self) -> str:
        """Return a text that identifies the list, for its cursors."""
        return sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()[:12]

    def cursor_after(self, row: ExperimentRow | StudyRow) -> str:
        """Return the cursor of the page that follows the row in this list."""
        key = (getattr(row, name) for name in ORDERS[type(row)][self.sort.removeprefix("-")])
        return encode(*key, bound_to=self.digest())


ORDERS: dict[type[Base], dict[str, tuple[str, ...]]] = {
    ExperimentRow: {
        "created_at": ("created_at", "position", "id"),
        "name": ("name", "id"),
        "strategy": ("strategy", "id"),
        "state": ("state", "id"),
    },
    StudyRow: {"created_at": ("created_at", "id"), "name": ("name", "id")},
}
"""The columns of each order."""

NEWEST_FIRST = ListFilter()


@snapshot
def list_experiments(
    session: Session, wanted: ListFilter = NEWEST_FIRST, *, limit: int = 50, cursor: str | None = None
) -> Page[ExperimentRead]:
    """Return a page of experiments; concurrent submissions do not shift later pages.

    Raises:
        InvalidSpec: the query is invalid, or the cursor is, or it is of another list.
    """
    row = ExperimentRow
    query = select(row).where(*experiments_meeting(wanted.q, all_=wanted.study is not None))
    if wanted.text:
        query = query.where(contains(wanted.text, *EXPERIMENT_TEXTS))
    equal = {row.study_id: wanted.study, row.strategy: wanted.strategy}
    query = query.where(*(column == storable(value) for column, value in equal.items() if value is not None))
    if wanted.alone:
        query = query.where(row.study_id.is_(None))
    if wanted.state is not None:
        query = query.where(row.state == wanted.state)
    rows = session.scalars(_cut(query, row, wanted, limit + 1, cursor)).all()
    return Page(items=view_experiments(session, rows[:limit]), next=next_cursor(rows, limit, wanted.cursor_after))


@snapshot
def list_studies(
    session: Session, wanted: ListFilter = NEWEST_FIRST, *, limit: int = 50, cursor: str | None = None
) -> Page[StudyRead]:
    """Return a page of studies.

    Raises:
        InvalidSpec: the query is invalid, or the cursor is, or it is of another list.
    """
    query = select(StudyRow).where(*studies_meeting(wanted.q))
    if wanted.text:
        query = query.where(contains(wanted.text, *STUDY_TEXTS))
    if wanted.strategy is not None:
        query = query.where(of_study(ExperimentRow.strategy == storable(wanted.strategy)))
    if wanted.state is not None:
        query = query.where(study_is(wanted.state))
    rows = session.scalars(_cut(query, StudyRow, wanted, limit + 1, cursor)).all()
    return Page(items=view_studies(session, rows[:limit]), next=next_cursor(rows, limit, wanted.cursor_after))


def _cut(query: Select[R], table: type[R], wanted: ListFilter, limit: int, cursor: str | None) -> Select[R]:
    names = ORDERS[table][wanted.sort.removeprefix("-")]
    columns = [
        type_coerce(ExperimentRow.state, String()) if name == "state" else getattr(table, name) for name in names
    ]
    falling = wanted.sort.startswith("-")
    if cursor is not None:
        key, after = tuple_(*columns), decode(cursor, columns, wanted.digest())
        query = query.where(key < after if falling else key > after)
    return query.order_by(*(each.desc() if falling else each.asc() for each in columns)).limit(limit)
