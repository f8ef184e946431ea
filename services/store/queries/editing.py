"""Names and notes of studies and experiments, changed."""

from collections.abc import Collection, Mapping

from sqlalchemy import update
from sqlalchemy.orm import Session

from gaplab.services.core.errors import Changed
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries.leases import plain


def edit(
    session: Session,
    row: ExperimentRow | StudyRow,
    changes: Mapping[str, str | None],
    starting_from: Collection[int] | None,
) -> None:
    """Change these columns of the row, and count it as one edit.

    Raises:
        Changed: the row has had another number of edits; nothing is changed.
    """
    table = type(row)
    values = {name: plain(value) if value is not None else None for name, value in changes.items()}
    statement = update(table).where(table.id == row.id).values(values | {"edits": table.edits + 1})
    if starting_from is not None:
        statement = statement.where(table.edits.in_(sorted(starting_from)))
    if session.execute(statement.returning(table.id)).first() is None:
        msg = f"{row.id!r} was changed by somebody else since it was looked at; look again, and then decide"
        raise Changed(msg)
    session.refresh(row)
