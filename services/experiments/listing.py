"""The list of studies, page by page, filtered and sorted.

A page begins after the key of the last row of the page before. The key is the sorted column, then the id. If a row's
name changes between two pages, both pages or neither may have it. Saved views are queries with a name.
"""

import json
from dataclasses import asdict, dataclass
from hashlib import sha256

from sqlalchemy import Float, Subquery, case, delete, func, literal, select, tuple_, update

from gaplab.schemas.editing import ViewRead, ViewSpec
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import Page, StudyRead
from gaplab.services.core.errors import InvalidSpec, LimitReached
from gaplab.services.core.strategies import strategies
from gaplab.services.experiments.query.conditions import conditions, containing, of_one, study_is
from gaplab.services.experiments.views import view
from gaplab.services.store.clock import moment
from gaplab.services.store.cursor import Column, decode, encode, next_cursor
from gaplab.services.store.models import ExperimentRow, StudyRow, ViewRow
from gaplab.services.store.queries.experiments import of_studies
from gaplab.services.store.queries.results import points_of_all
from gaplab.services.store.session import Session, snapshot, transaction
from gaplab.services.store.statements import existing, insert_new, storable


@dataclass(frozen=True)
class ListFilter:
    """The selection and the order of a list.

    Attributes:
        state: only studies in this state.
        strategy: only studies that have an experiment with this strategy.
        text: only studies whose name, id, notes or tags contain this text, or the id of an experiment of them.
        q: query, as `gaplab.services.experiments.query` has it. Archived ones are left out unless it mentions them.
        sort: `created_at`, `name`, `state` or `fitness`, which is the highest of its experiments; a minus before it
            reverses the order, and one without a fitness is last in both.
    """

    state: State | None = None
    strategy: str | None = None
    text: str | None = None
    q: str | None = None
    sort: str = "-created_at"

    def digest(self) -> str:
        """Return a text that identifies the list, for its cursors."""
        return sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()[:12]


LARGEST = 1e308
"""In place of a missing fitness: databases sort NULL differently, and cursors compare keys."""

NEWEST_FIRST = ListFilter()


@snapshot
def list_studies(
    session: Session, wanted: ListFilter = NEWEST_FIRST, *, limit: int = 50, cursor: str | None = None
) -> Page[StudyRead]:
    """Return a page of studies; concurrent submissions do not shift later pages.

    Raises:
        InvalidSpec: the query is invalid, or the cursor is, or it is of another list.
    """
    falling, fitness = wanted.sort.startswith("-"), _fitness()
    columns = (_key(wanted.sort, fitness), StudyRow.id)
    query = select(StudyRow, columns[0]).where(*conditions(wanted.q))
    if wanted.sort.endswith("fitness"):
        query = query.outerjoin(fitness, fitness.c.study_id == StudyRow.id)
    if wanted.text:
        query = query.where(containing(wanted.text))
    if wanted.strategy is not None:
        query = query.where(of_one(ExperimentRow.strategy == storable(wanted.strategy)))
    if wanted.state is not None:
        query = query.where(study_is(wanted.state))
    if cursor is not None:
        key, after = tuple_(*columns), decode(cursor, columns, wanted.digest())
        query = query.where(key < after if falling else key > after)
    query = query.order_by(*(each.desc() if falling else each.asc() for each in columns)).limit(limit + 1)
    rows = session.execute(query).all()
    found = of_studies(session, [row for row, _ in rows[:limit]])
    next_ = next_cursor(rows, limit, lambda last: encode(last[1], last[0].id, bound_to=wanted.digest()))
    return Page(items=view(session, *found), next=next_)


def _key(order: str, fitness: Subquery) -> Column:
    match order.removeprefix("-"):
        case "state":
            return case(*((study_is(state), place) for place, state in enumerate(State)))
        case "fitness":
            return func.coalesce(fitness.c.best, literal(-LARGEST if order.startswith("-") else LARGEST))
        case name:
            column: Column = getattr(StudyRow, name)
            return column


def _fitness() -> Subquery:
    """Return the highest fitness of each study; that of the direct baseline only if there is no other."""
    points, value = points_of_all()
    means = points.add_columns(func.avg(value, type_=Float).label("mean")).subquery()
    learned = ExperimentRow.strategy.not_in([name for name, each in strategies.items() if each.in_reality])
    best = func.coalesce(func.max(case((learned, means.c.mean))), func.max(means.c.mean)).label("best")
    query = select(ExperimentRow.study_id, best).join(means, means.c.experiment_id == ExperimentRow.id)
    return query.group_by(ExperimentRow.study_id).subquery()


MOST = 200
"""Views of a service."""


@snapshot
def list_views(session: Session) -> tuple[ViewRead, ...]:
    """Return the views, by name."""
    return tuple(map(ViewRead.filled_from, session.scalars(select(ViewRow).order_by(ViewRow.name))))


@snapshot
def read_view(session: Session, name: str) -> ViewRead:
    """Return a view."""
    return _found(session, name)


@transaction
def save_view(session: Session, name: str, spec: ViewSpec) -> ViewRead:
    """Save a view, or replace the one with this name.

    Raises:
        InvalidSpec: its query is invalid.
        LimitReached: there are too many views.
    """
    try:
        conditions(spec.query)
    except InvalidSpec as error:
        raise InvalidSpec(violation.moved("q", "/query") for violation in error.violations) from error
    query = storable(spec.query) if spec.query else None
    shown = {"query": query, "sort": spec.sort}
    if session.get(ViewRow, storable(name)) is None:
        if session.execute(select(func.count()).select_from(ViewRow)).scalar_one() >= MOST:
            raise LimitReached(f"this service has {MOST} saved views already: delete one first")
        new = insert_new(session, ViewRow).values(name=storable(name), created_at=moment(session), **shown)
        session.execute(new)  # waits for another one of this name, which is replaced like an earlier one
    row = ViewRow
    session.execute(update(row).where(row.name == storable(name)).values(shown))
    return _found(session, name)


@transaction
def delete_view(session: Session, name: str) -> ViewRead:
    """Delete a view, and return it."""
    view = _found(session, name)
    session.execute(delete(ViewRow).where(ViewRow.name == view.name))
    return view


def _found(session: Session, name: str) -> ViewRead:
    return ViewRead.filled_from(existing(session, ViewRow, name, "saved view"))
