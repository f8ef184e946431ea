"""Pages of experiments and studies, filtered and sorted.

A page begins after the key of the last row of the page before. The key is what the list is sorted by, then the id. A
row whose state or name changes between two pages may be in both or in none.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from hashlib import sha256
from typing import Any

from sqlalchemy import ColumnElement, Select, String, or_, select, tuple_, type_coerce
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import OPEN, State
from gaplab.services.store.cursor import Column, decode, encode
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries.leases import plain

Key = tuple[str | int | datetime, ...]


@dataclass(frozen=True)
class Which:
    """What is listed, and in which order.

    Attributes:
        study: only experiments of it.
        state: only in this state; a study's is that of its experiments taken together.
        strategy: only with this one; studies that have it.
        text: only where the name or the id has it in it.
        sort: a name of EXPERIMENT_ORDERS or STUDY_ORDERS; a minus before it turns it round.
    """

    study: str | None = None
    state: State | None = None
    strategy: str | None = None
    text: str | None = None
    sort: str = "-created_at"

    def digest(self) -> str:
        """What a cursor is bound to."""
        return sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()[:12]


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


def page_of_experiments(session: Session, which: Which, *, limit: int, cursor: str | None) -> tuple[ExperimentRow, ...]:
    """Up to `limit` experiments.

    Raises:
        InvalidSpec: a cursor that is none, or of another list.
    """
    row = ExperimentRow
    query = select(row).where(*_text(which.text, row.name, row.id))
    wanted = {row.study_id: which.study, row.strategy: which.strategy}
    query = query.where(*(column == plain(value) for column, value in wanted.items() if value is not None))
    if which.state is not None:
        query = query.where(row.state == which.state)
    return tuple(session.scalars(_cut(query, which, EXPERIMENT_ORDERS, limit, cursor)))


def page_of_studies(session: Session, which: Which, *, limit: int, cursor: str | None) -> tuple[StudyRow, ...]:
    """Up to `limit` studies.

    Raises:
        InvalidSpec: a cursor that is none, or of another list.
    """
    query = select(StudyRow).where(*_text(which.text, StudyRow.name, StudyRow.id))
    if which.strategy is not None:
        query = query.where(_has(ExperimentRow.strategy == plain(which.strategy)))
    if which.state is not None:
        query = query.where(*_study_is(which.state))
    return tuple(session.scalars(_cut(query, which, STUDY_ORDERS, limit, cursor)))


def cursor_after(row: ExperimentRow | StudyRow, which: Which) -> str:
    """The cursor of the page that follows the row in this list."""
    orders = EXPERIMENT_ORDERS if isinstance(row, ExperimentRow) else STUDY_ORDERS
    return encode(*orders[which.sort.removeprefix("-")].key(row), bound_to=which.digest())


def _cut(query: Select[Any], which: Which, orders: dict[str, Order], limit: int, cursor: str | None) -> Select[Any]:
    columns = orders[which.sort.removeprefix("-")].columns
    falling = which.sort.startswith("-")
    if cursor is not None:
        key, after = tuple_(*columns), decode(cursor, columns, which.digest())
        query = query.where(key < after if falling else key > after)
    return query.order_by(*(each.desc() if falling else each.asc() for each in columns)).limit(limit)


def _text(text: str | None, *columns: Column) -> Sequence[ColumnElement[bool]]:
    """That one of the columns has it in it; on SQLite only ASCII letters are alike in both cases."""
    return [or_(*(each.icontains(plain(text), autoescape=True) for each in columns))] if text else []


def _has(condition: ColumnElement[bool]) -> ColumnElement[bool]:
    return select(ExperimentRow.id).where(ExperimentRow.study_id == StudyRow.id, condition).exists()


def _study_is(state: State) -> list[ColumnElement[bool]]:
    """That the experiments taken together are in the state, as `reads.state_of` says for one study."""
    open_ = _has(ExperimentRow.state.in_(OPEN))
    if state is State.RUNNING:
        return [open_, *(~_all_left_are(each) for each in OPEN if each is not State.RUNNING)]
    if not state.ended:
        return [open_, _all_left_are(state)]
    ends = (State.COMPLETED, State.FAILED, State.CANCELLED)
    return [
        ~open_,
        _has(ExperimentRow.state == state),
        *(~_has(ExperimentRow.state == each) for each in ends[: ends.index(state)]),
    ]


def _all_left_are(state: State) -> ColumnElement[bool]:
    """That those which have not ended, or if they are to be QUEUED all of them, are in that state."""
    others = State if state is State.QUEUED else OPEN
    return ~_has(ExperimentRow.state.in_([each for each in others if each is not state]))
