"""Work that had not ended, as an archive has it: without leases, CANCELLED or PAUSED, since nothing runs there."""

from collections.abc import Collection
from datetime import datetime

from gaplab.schemas.lifecycle import Ending, State
from gaplab.services.archives.columns import EXPERIMENT, Row


def owner_of(table: str, row: Row) -> str:
    """Return the id of the experiment that a row belongs to; "" of a row that belongs to none."""
    owner: str = row["id"] if table == "experiment" else row.get(EXPERIMENT) or row.get("experiment_id") or ""
    return owner


def is_over(row: Row) -> bool:
    """Return whether an experiment, a repetition or an attempt has ended, and has the time of its end."""
    return row["ended_at"] is not None and State(row.get("state", State.COMPLETED)).ended


def resting(table: str, row: Row, on_bench: Collection[str], now: datetime | None = None) -> Row:
    """Return a row without the state of work that is under way.

    It is CANCELLED, since the archive hides the parameters of reality. Where reality is a robot on a bench nothing is
    hidden: an experiment is PAUSED, and its repetitions are QUEUED.

    Args:
        table: the row's table.
        row: the row.
        on_bench: the experiments on a bench that have not ended.
        now: when it ends; None if its end is not to be said.
    """
    if table not in {"experiment", "repetition", "attempt"} or is_over(row):
        return row
    physical = owner_of(table, row) in on_bench
    if table == "attempt":
        return row | {"ending": Ending.HANDED_BACK if physical else Ending.CANCELLED, "ended_at": now}
    if physical:
        return row | {"state": State.PAUSED if table == "experiment" else State.QUEUED, "ended_at": None}
    return row | {"state": State.CANCELLED, "ended_at": now}
