"""Lists of experiments and studies, page by page, filtered and sorted. Use cases raise StoreUnavailable.

A page begins after the key of the last row of the page before. The key is the sorted column, then the id. If a row's
state or name changes between two pages, both pages or neither may have it.
"""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from datetime import datetime
from hashlib import sha256
from typing import Any

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
from gaplab.services.store.cursor import Column, decode, encode, next_cursor
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.session import Session, snapshot
from gaplab.services.store.statements import storable

Key = tuple[str | int | datetime, ...]


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
        sort: a name of EXPERIMENT_ORDERS or STUDY_ORDERS; a minus before it reverses the order.
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
        orders = EXPERIMENT_ORDERS if isinstance(row, ExperimentRow) else STUDY_ORDERS
        return encode(*orders[self.sort.removeprefix("-")].key(row), bound_to=self.digest())


@dataclass(frozen=True)
class Order:
    """An order of a list: its columns, and the key of a row in them."""

    columns: tuple[Column, ...]
    key: Callable[[Any], Key]


_STATE = type_coerce(ExperimentRow.state, String())

EXPERIMENT_ORDERS = {
    "created_at": Order(
        (ExperimentRow.created_at, ExperimentRow.position, ExperimentRow.id),
        lambda row: (row.created_at, row.position, row.id),
    ),
    "name": Order((ExperimentRow.name, ExperimentRow.id), lambda row: (row.name, row.id)),
    "strategy": Order((ExperimentRow.strategy, ExperimentRow.id), lambda row: (row.strategy, row.id)),
    "state": Order((_STATE, ExperimentRow.id), lambda row: (row.state.value, row.id)),
}

STUDY_ORDERS = {
    "created_at": Order((StudyRow.created_at, StudyRow.id), lambda row: (row.created_at, row.id)),
    "name": Order((StudyRow.name, StudyRow.id), lambda row: (row.name, row.id)),
}


NEWEST_FIRST = ListFilter()


@snapshot
def list_experiments(
    session: Session, wanted: ListFilter = NEWEST_FIRST, *, limit: int = 50, cursor: str | None = None
) -> Page[ExperimentRead]:
    """Return a page of experiments; concurrent submissions do not shift later pages.

    Raises:
        InvalidSpec: the query is invalid, or the cursor is, or it is of another list.
    """
    rows = _page_of_experiments(session, wanted, limit=limit + 1, cursor=cursor)
    return Page(items=view_experiments(session, rows[:limit]), next=next_cursor(rows, limit, wanted.cursor_after))


@snapshot
def list_studies(
    session: Session, wanted: ListFilter = NEWEST_FIRST, *, limit: int = 50, cursor: str | None = None
) -> Page[StudyRead]:
    """Return a page of studies.

    Raises:
        InvalidSpec: the query is invalid, or the cursor is, or it is of another list.
    """
    rows = _page_of_studies(session, wanted, limit=limit + 1, cursor=cursor)
    return Page(items=view_studies(session, rows[:limit]), next=next_cursor(rows, limit, wanted.cursor_after))


def _page_of_experiments(
    session: Session, wanted: ListFilter, *, limit: int, cursor: str | None
) -> tuple[ExperimentRow, ...]:
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
    return tuple(session.scalars(_cut(query, wanted, EXPERIMENT_ORDERS, limit, cursor)))


def _page_of_studies(session: Session, wanted: ListFilter, *, limit: int, cursor: str | None) -> tuple[StudyRow, ...]:
    query = select(StudyRow).where(*studies_meeting(wanted.q))
    if wanted.text:
        query = query.where(contains(wanted.text, *STUDY_TEXTS))
    if wanted.strategy is not None:
        query = query.where(of_study(ExperimentRow.strategy == storable(wanted.strategy)))
    if wanted.state is not None:
        query = query.where(study_is(wanted.state))
    return tuple(session.scalars(_cut(query, wanted, STUDY_ORDERS, limit, cursor)))


def _cut(
    query: Select[Any], wanted: ListFilter, orders: dict[str, Order], limit: int, cursor: str | None
) -> Select[Any]:
    columns = orders[wanted.sort.removeprefix("-")].columns
    falling = wanted.sort.startswith("-")
    if cursor is not None:
        key, after = tuple_(*columns), decode(cursor, columns, wanted.digest())
        query = query.where(key < after if falling else key > after)
    return query.order_by(*(each.desc() if falling else each.asc() for each in columns)).limit(limit)
