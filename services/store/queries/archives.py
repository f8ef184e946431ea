"""Rows of whole tables, for archives: read in a stable order, and inserted in bulk."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import Enum
from itertools import islice
from typing import Any

from sqlalchemy import Select, delete, insert, select
from sqlalchemy.exc import DataError, IntegrityError, SQLAlchemyError
from sqlalchemy.orm import Session

from gaplab.services.store.models import (
    Base,
    DeletionRow,
    ExperimentProvenanceRow,
    ExperimentRow,
    RepetitionRow,
    StudyRow,
)
from gaplab.services.store.queries import attachments, attempts, files
from gaplab.services.store.statements import wait_for_others
from gaplab.services.world.robot_library import named_in

Row = dict[str, Any]

Refused = (IntegrityError, DataError)
"""Errors of the database for rows that contradict each other, or do not fit their table."""

Unreadable = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError, SQLAlchemyError)
"""Errors of reading a value that its column does not permit, from a database that another program wrote."""

REPETITION_ID, EXPERIMENT, REPETITION = "repetition_id", "experiment", "repetition"
"""Rows have the experiment and the number of a repetition instead of its id, which one database generated."""

_AT_ONCE = 500
_LOCK = 0x67617069  # among the advisory locks of a Postgres database
_REPETITIONS = Base.metadata.tables["repetition"]
_SHARED: dict[str, Callable[[Session, Sequence[Row]], None]] = {
    "provenance": attempts.insert_provenances,
    "file": files.insert_unless_there,
    "attachment": attachments.insert_unless_there,
}
_REPLACED = {EXPERIMENT: _REPETITIONS.c.experiment_id, REPETITION: _REPETITIONS.c.number}


def read_rows(
    session: Session, name: str, columns: Iterable[str], owners: Sequence[str], at_once: int = _AT_ONCE
) -> Iterator[Row]:
    """Yield the rows of experiments in a table, as the database returns them.

    Args:
        session: a snapshot of the database.
        name: the table.
        columns: their names, with `EXPERIMENT` and `REPETITION` in place of the id of a repetition.
        owners: ids of experiments, or of studies if the table is `study`; rows have this order.
        at_once: number of rows in memory, of files one.
    """
    columns = list(columns)
    for query in _queries(session, name, columns, owners):
        at_once = 1 if "content" in columns else at_once
        for row in session.execute(query, execution_options={"yield_per": at_once}).mappings():
            yield {key: value.value if isinstance(value, Enum) else value for key, value in row.items()}


def all_ids(session: Session, model: type[StudyRow | ExperimentRow]) -> list[str]:
    """Return the ids of all studies or experiments, those of a study in its order."""
    order = (model.id,) if model is StudyRow else (ExperimentRow.position, model.id)
    return list(session.scalars(select(model.id).order_by(*order)))


def taken_ids(session: Session, ids: set[str]) -> set[str]:
    """Return the ids that a study or an experiment has already; a concurrent import waits here for this one's end."""
    wait_for_others(session, _LOCK)
    queries = (select(row.id).where(row.id.in_(ids)) for row in (StudyRow, ExperimentRow))
    return {each for query in queries for each in session.scalars(query)}


def forget_deletions(session: Session, ids: Iterable[str]) -> None:
    """Forget that studies and experiments with these ids were deleted: they are there again."""
    session.execute(delete(DeletionRow).where(DeletionRow.id.in_(list(ids))))


def insert_rows(session: Session, name: str, rows: Iterable[Row], at_once: int = _AT_ONCE) -> None:
    """Insert rows into a table, so many at once, and files one at a time.

    Raises:
        IntegrityError: a row exists already, or belongs to a row that does not exist.
        DataError: a value does not fit its column.
        KeyError: a row belongs to a repetition that does not exist.
    """
    table, incoming = Base.metadata.tables[name], iter(rows)
    while some := list(islice(incoming, 1 if name == "attachment" else at_once)):
        if name in _SHARED:
            _SHARED[name](session, some)
        else:
            session.execute(insert(table), _with_ids(session, some) if REPETITION_ID in table.c else some)


def _queries(session: Session, name: str, columns: Sequence[str], owners: Sequence[str]) -> list[Select[Any]]:
    match name:
        case "provenance":
            use = ExperimentProvenanceRow
            used = select(use.provenance_id).where(use.experiment_id.in_(owners))
            return [_shared(name, columns, used)]
        case "file":
            specs = session.scalars(select(ExperimentRow.spec).where(ExperimentRow.id.in_(owners)))
            return [_shared(name, columns, sorted({each for spec in specs for each in named_in(spec)}))]
        case "attachment":
            row = RepetitionRow
            repetitions = select(row.id).where(row.experiment_id.in_(owners)).scalar_subquery()
            ids = sorted(attachments.named(session, repetitions))
            parts = [ids[start : start + _AT_ONCE] for start in range(0, len(ids), _AT_ONCE)]
            return [_shared(name, columns, part) for part in parts]
    return [_query(name, columns, owner) for owner in owners]


def _shared(name: str, columns: Sequence[str], ids: Select[str] | Sequence[str]) -> Select[Any]:
    """Return the query for rows of a table that experiments share, whose key is a hash."""
    table = Base.metadata.tables[name]
    (key,) = table.primary_key.columns
    return select(*(table.c[each] for each in columns)).where(key.in_(ids)).order_by(key)


def _with_ids(session: Session, rows: Sequence[Row]) -> list[Row]:
    model = RepetitionRow
    owners = {row[EXPERIMENT] for row in rows}
    found = session.execute(select(model.experiment_id, model.number, model.id).where(model.experiment_id.in_(owners)))
    ids = {(experiment, number): id_ for experiment, number, id_ in found}
    return [
        {key: value for key, value in row.items() if key not in _REPLACED}
        | {REPETITION_ID: ids[row[EXPERIMENT], row[REPETITION]]}
        for row in rows
    ]


def _query(name: str, columns: Sequence[str], owner: str) -> Select[Any]:
    table = Base.metadata.tables[name]
    key = [each for each in table.primary_key.columns if each.name != REPETITION_ID]
    if REPETITION_ID in table.c:
        query = select(*((_REPLACED if each in _REPLACED else table.c)[each].label(each) for each in columns))
        query = query.join_from(table, _REPETITIONS, _REPETITIONS.c.id == table.c.repetition_id)
        return query.where(_REPETITIONS.c.experiment_id == owner).order_by(_REPETITIONS.c.number, *key)
    owned_by = table.c.id if name in {"study", "experiment"} else table.c.experiment_id
    order = [table.c.number] if table is _REPETITIONS else key
    return select(*(table.c[each] for each in columns)).where(owned_by == owner).order_by(*order)
