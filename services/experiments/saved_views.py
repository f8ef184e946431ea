"""Saved views. Each function is one transaction, and raises StoreUnavailable while the database cannot be used."""

from sqlalchemy import delete, func, select, update

from gaplab.schemas.editing import ViewRead, ViewSpec
from gaplab.services.core.errors import InvalidSpec, LimitReached, NotFound
from gaplab.services.experiments.query.conditions import conditions
from gaplab.services.store.clock import moment
from gaplab.services.store.models import ViewRow
from gaplab.services.store.session import Session, snapshot, transaction
from gaplab.services.store.statements import insert_new, storable

MOST = 200
"""Views of a service."""


@snapshot
def list_views(session: Session) -> tuple[ViewRead, ...]:
    """Return the views, by name."""
    return tuple(map(_view, session.scalars(select(ViewRow).order_by(ViewRow.name))))


@snapshot
def read_view(session: Session, name: str) -> ViewRead:
    """Return a view.

    Raises:
        NotFound: no such view.
    """
    return _view(_get(session, name))


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
    return _view(_get(session, name))


@transaction
def delete_view(session: Session, name: str) -> ViewRead:
    """Delete a view, and return it.

    Raises:
        NotFound: no such view.
    """
    view = _view(_get(session, name))
    session.execute(delete(ViewRow).where(ViewRow.name == view.name))
    return view


def _get(session: Session, name: str) -> ViewRow:
    if (row := session.get(ViewRow, storable(name))) is None:
        raise NotFound(f"there is no saved view {name!r}")
    return row


def _view(row: ViewRow) -> ViewRead:
    return ViewRead.model_validate({name: getattr(row, name) for name in ViewRead.model_fields})
