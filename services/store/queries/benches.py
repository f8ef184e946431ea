"""Names of benches: however a name is spaced and capitalised, it is one bench, and spelled as it was first written."""

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from gaplab.services.store.models import RequestRow
from gaplab.services.store.statements import storable


def key_of(bench: str) -> str:
    """Return what the spellings of a bench share."""
    return " ".join(storable(bench).split()).casefold()[:200]


def spellings(session: Session, bench: str | None = None) -> list[str]:
    """Return how requests spell a bench, or all benches if it is None; the first written is the first."""
    row = RequestRow
    found = session.scalars(select(row.bench).group_by(row.bench).order_by(func.min(row.created_at)))
    return [each for each in found if bench is None or key_of(each) == key_of(bench)]
