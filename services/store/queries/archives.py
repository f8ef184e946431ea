"""Rows of any exported table, out of a database and into one; `gaplab.services.store.archive_columns` says which."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from enum import Enum
from itertools import islice
from typing import Any

from sqlalchemy import ColumnElement, Select, Table, insert, select, text
from sqlalchemy.exc import DataError, IntegrityError
from sqlalchemy.orm import Session

from gaplab.services.store.archive_columns import COLUMNS_LEFT_OUT, EXPERIMENT, REPETITION, columns_of, table_of
from gaplab.services.store.clock import now
from gaplab.services.store.models import ExperimentProvenanceRow, ExperimentRow, ProvenanceRow, RepetitionRow, StudyRow
from gaplab.services.store.queries import provenance
from gaplab.services.store.queries.experiments import new_id
from gaplab.services.store.stored_specs import without_truth

__all__ = ["Refused", "free", "insert_rows", "moment", "rows"]

Row = dict[str, Any]

Refused = (IntegrityError, DataError)
"""What a database says to rows that contradict each other, or that have no place in it."""

_AT_ONCE = 1_000
_LOCK = 0x67617069  # among the advisory locks of a Postgres database
_REPETITIONS = table_of("repetition")
_REPLACED = {EXPERIMENT: _REPETITIONS.c.experiment_id, REPETITION: _REPETITIONS.c.number}


def rows(
    session: Session, name: str, *, study: str | None, experiments: Sequence[str], hidden: Collection[str]
) -> Iterator[Row]:
    """The rows that these experiments have in a table, as they come from the database, a few at a time.

    Args:
        session: of the moment of which the rows are.
        name: of the table.
        study: that is exported with its experiments; without one, the experiments are cut off from theirs.
        experiments: in the order in which their rows come.
        hidden: those whose reality's parameters are null.
    """
    cut_off = {"study_id": None} if study is None else {}
    if name == "provenance":  # experiments have them in common
        used = select(ExperimentProvenanceRow.provenance_id).where(
            ExperimentProvenanceRow.experiment_id.in_(experiments)
        )
        columns = [table_of(name).c[each.name] for each in columns_of(name)]
        found = session.execute(select(*columns).where(ProvenanceRow.id.in_(used)).order_by(ProvenanceRow.id))
        yield from map(dict, found.mappings())
        return
    for owner in ([study] if study else []) if name == "study" else experiments:
        found = session.execute(_query(name, owner), execution_options={"yield_per": _AT_ONCE})
        for each in found.mappings():
            row = {key: value.value if isinstance(value, Enum) else value for key, value in each.items()}
            row |= {key: value for key, value in cut_off.items() if key in row}
            yield {key: _hide(value) for key, value in row.items()} if owner in hidden else row


def free(session: Session, model: type[StudyRow | ExperimentRow], wanted: Iterable[str]) -> dict[str, str]:
    """The id under which each is stored here: its own, or a new one if that is taken.

    No other import looks until this one's transaction ends: of two of the same archive, one would be refused.
    """
    if session.get_bind().dialect.name == "postgresql":  # in SQLite no two transactions that write ever overlap
        session.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": _LOCK})
    ids = list(wanted)
    taken = set(session.scalars(select(model.id).where(model.id.in_(ids))))
    return {each: new_id() if each in taken else each for each in ids}


def moment(session: Session) -> datetime:
    """Now, by the database's clock."""
    return session.execute(select(now())).scalar_one()


def insert_rows(session: Session, name: str, found: Iterable[Row]) -> int:
    """Add rows of an archive to a table, a few at a time; how many they were.

    Args:
        session: of a transaction that writes.
        name: of the table.
        found: checked, with the ids of experiments and studies as they are here.

    Raises:
        IntegrityError: a row is there twice, or what it belongs to is not there.
        DataError: a value has no place in its column.
        KeyError: as well, if that is a repetition.
    """
    table, count, incoming = table_of(name), 0, iter(found)
    numbered = "repetition_id" in table.c
    while some := list(islice(incoming, _AT_ONCE)):
        values = _numbered(session, some) if numbered else some
        if name == "provenance":
            provenance.insert_unless_there(session, values)
        else:
            session.execute(insert(table), values)
        count += len(some)
    return count


def _numbered(session: Session, some: Sequence[Row]) -> list[Row]:
    """With the numbers that this database gave to their repetitions.

    Raises:
        KeyError: a row belongs to a repetition that is not there.
    """
    row = RepetitionRow
    owners = {each[EXPERIMENT] for each in some}
    found = session.execute(select(row.experiment_id, row.number, row.id).where(row.experiment_id.in_(owners)))
    ids = {(experiment, number): id_ for experiment, number, id_ in found}
    return [
        {key: value for key, value in each.items() if key not in _REPLACED}
        | {"repetition_id": ids[each[EXPERIMENT], each[REPETITION]]}
        for each in some
    ]


def _query(name: str, owner: str) -> Select[Any]:
    table = table_of(name)
    numbered = "repetition_id" in table.c
    columns = [(_REPLACED[each.name] if numbered and each.name in _REPLACED else table.c[each.name]).label(each.name)
               for each in columns_of(name)]  # fmt: skip
    query = select(*columns).select_from(table).where(_belongs(table, owner))
    key = [each for each in table.primary_key.columns if each.name != "repetition_id"]
    if not numbered:
        return query.order_by(*([table.c.number] if table is _REPETITIONS else key))
    query = query.join(_REPETITIONS, _REPETITIONS.c.id == table.c.repetition_id)
    return query.order_by(_REPETITIONS.c.number, *key)


def _belongs(table: Table, owner: str) -> ColumnElement[bool]:
    if table.name in {"study", "experiment"}:
        return table.c.id == owner
    column = table.c.experiment_id if "experiment_id" in table.c else _REPETITIONS.c.experiment_id
    return column == owner


def _hide(value: Any) -> Any:  # noqa: ANN401 - JSON
    """The same without reality's parameters, wherever a spec stands in it."""
    if isinstance(value, Mapping):
        reality = value.get("reality")
        shown = without_truth(value) if isinstance(reality, Mapping) and "parameters" in reality else value
        return {key: _hide(each) for key, each in shown.items()}
    if isinstance(value, list):
        return [_hide(each) for each in value]
    return value


assert all(column in table_of(name).c for name, column in COLUMNS_LEFT_OUT)
