"""Lists of experiments and studies, page by page. Each function is one transaction, and raises StoreUnavailable."""

from collections.abc import Sequence
from typing import TypeVar

from gaplab.schemas.records import ExperimentRead, Page, StudyRead
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries import listing, reads
from gaplab.services.store.queries.listing import Which as Which
from gaplab.services.store.session import Store

R = TypeVar("R", ExperimentRow, StudyRow)

NEWEST_FIRST = Which()


def list_experiments(
    store: Store, which: Which = NEWEST_FIRST, *, limit: int = 50, cursor: str | None = None
) -> Page[ExperimentRead]:
    """A page of experiments; what is submitted meanwhile shifts no later page.

    Raises:
        InvalidSpec: a cursor that no page of this list gave.
    """
    with store.reading() as session:
        rows = listing.page_of_experiments(session, which, limit=limit + 1, cursor=cursor)
        shown = reads.read_experiments(session, rows[:limit])
    return Page(items=shown, next=_next(rows, limit, which))


def list_studies(
    store: Store, which: Which = NEWEST_FIRST, *, limit: int = 50, cursor: str | None = None
) -> Page[StudyRead]:
    """A page of studies.

    Raises:
        InvalidSpec: a cursor that no page of this list gave.
    """
    with store.reading() as session:
        rows = listing.page_of_studies(session, which, limit=limit + 1, cursor=cursor)
        shown = reads.read_studies(session, rows[:limit])
    return Page(items=shown, next=_next(rows, limit, which))


def _next(rows: Sequence[R], limit: int, which: Which) -> str | None:
    """The cursor of the page that follows; `rows` has one more than the page if there is one."""
    return listing.cursor_after(rows[limit - 1], which) if len(rows) > limit else None
