"""The tables of an archive that have rows, and the columns of these that have values.

Each table is exported, or left out for a reason; a column that is added to an exported table is exported from then on.
Columns that are left out are null, or have the value of a database in which nothing runs.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache

from gaplab.schemas.lifecycle import Ending, State
from gaplab.services.store import tables
from gaplab.services.store.queries.archives import EXPERIMENT as EXPERIMENT
from gaplab.services.store.queries.archives import REPETITION as REPETITION
from gaplab.services.store.queries.archives import REPETITION_ID
from gaplab.services.store.queries.archives import Row as Row
from gaplab.services.store.tables import Column

EXPORTED = (
    "file",
    "provenance",
    "study",
    "experiment",
    "experiment_provenance",
    "repetition",
    "branch",
    "step",
    "attempt",
    "request",
    "attachment",
    "answer",
)
"""The exported tables, in the order of insertion: each after the tables that it refers to."""

LEFT_OUT: Mapping[str, str] = {
    "sensitivity": "follows from what is tuned, and is shared by all experiments that tune the same",
    "event": "is numbered without gaps in the one database where it happened",
    "event_counter": "counts the events of one database",
    "supervisor": "is a process of one service",
    "token": "is a secret of one service",
    "idempotency": "belongs to requests to one service",
    "notification": "was sent by one service",
    "notifier": "is a place in the events of one service",
    "deletion": "tells what one service no longer has",
    "view": "is a list of one service",
    "checkpoint": "is part of an unfinished step, which only its own service continues",
}
"""Tables that are left out, each with the reason."""

COLUMNS_LEFT_OUT: Mapping[str, Mapping[str, str]] = {
    "file": {"created_at": "says when one service got the file"},
    "study": {
        "archived_at": "hides it in the lists of one service",
        "webhook": "is an address of one person, and may be a secret",
    },
    "experiment": {
        "token_id": "names a token of one service",
        "sensitivity_id": "names a check of one service",
        "running": "counts leases, and an archive has none",
        "turn_at": "is about turns in one service",
        "claimable": "follows from the states of repetitions",
        "paused_because": "is about work that goes on, and an archive has none",
        "hardware": "names hardware of one laboratory; it follows from the spec",
    },
    "repetition": {
        "checkpoints": "counts checkpoints, which are left out",
        "owner": "names a machine and a process there",
        "heartbeat_at": "belongs to a lease, and an archive has none",
        "hardware": "belongs to a lease, and an archive has none",
        "measuring_at": "belongs to a lease, and an archive has none",
        "hidden_error": "may name hidden parameters",
    },
    "attempt": {"hidden_reason": "may name hidden parameters"},
    "request": {
        "held": "belongs to a take, and an archive has none",
        "taken_by": "belongs to a take, and an archive has none",
        "taken_until": "belongs to a take, and an archive has none",
        "lease_s": "belongs to a take, and an archive has none",
    },
    "attachment": {"created_at": "says when one service got the file"},
    "answer": {"token_id": "names a token of one service"},
}
"""Columns of exported tables that are left out, each with the reason."""


@cache
def columns_of(table: str) -> tuple[Column, ...]:
    """Return the columns of a table that an archive has.

    The id of a repetition is replaced by its experiment and its number.
    """
    left_out = COLUMNS_LEFT_OUT.get(table, {})
    kept = [each for each in tables.columns_of(table) if not (each.generated or each.name in left_out)]
    return tuple(column for each in kept for column in _replaced(each))


def _replaced(column: Column) -> tuple[Column, ...]:
    if column.name != REPETITION_ID:
        return (column,)
    return replace(column, name=EXPERIMENT, type=str, longest=32), replace(column, name=REPETITION)


_EARLIEST = datetime(1980, 1, 1, tzinfo=UTC)


def at_rest(table: str, row: Row) -> Row:
    """Return values for the columns that are left out and may not be null."""
    match table:
        case "experiment":
            return {"running": 0, "claimable": False, "turn_at": row["created_at"]}
        case "repetition":
            return {"checkpoints": 0}
        case "file" | "attachment":
            return {"created_at": _EARLIEST}
    return {}


def owner_of(table: str, row: Row) -> str:
    """Return the id of the experiment that a row belongs to; "" of a row that belongs to none."""
    owner: str = row["id"] if table == "experiment" else row.get(EXPERIMENT) or row.get("experiment_id") or ""
    return owner


def is_over(row: Row) -> bool:
    """Return whether an experiment, a repetition or an attempt has ended, and has the time of its end."""
    return row["ended_at"] is not None and State(row.get("state", State.COMPLETED)).ended


def resting(table: str, row: Row, going_on: Collection[str], now: datetime | None = None) -> Row:
    """Return a row without the state of work that is under way.

    It is CANCELLED where the archive hides the parameters of reality. What can go on, since nothing is hidden, like a
    robot on a bench, rests: an experiment is PAUSED, and its repetitions are QUEUED.

    Args:
        table: the row's table.
        row: the row.
        going_on: the experiments that have not ended, and of whose reality nothing is hidden.
        now: when it ends; None if its end is not to be said.
    """
    if table not in {"experiment", "repetition", "attempt"} or is_over(row):
        return row
    rests = owner_of(table, row) in going_on
    if table == "attempt":
        return row | {"ending": Ending.HANDED_BACK if rests else Ending.CANCELLED, "ended_at": now}
    if rests:
        return row | {"state": State.PAUSED if table == "experiment" else State.QUEUED, "ended_at": None}
    return row | {"state": State.CANCELLED, "ended_at": now}
