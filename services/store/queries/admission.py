"""What is under way, to be held against limits."""

from dataclasses import dataclass

from sqlalchemy import case, func, select, text
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.services.store.models import ExperimentRow, RepetitionRow

_LOCK = 0x67617071  # among the advisory locks of a Postgres database


@dataclass(frozen=True)
class Load:
    """Experiments that have not ended, and the rollouts that they have left."""

    experiments: int
    rollouts: int


def one_at_a_time(session: Session) -> None:
    """Let no two transactions count what is under way at once; in SQLite none that write ever overlap."""
    if session.get_bind().dialect.name == "postgresql":
        session.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": _LOCK})


def load(session: Session) -> dict[str | None, Load]:
    """What is under way, by the id of the token that submitted it."""
    row, run = ExperimentRow, RepetitionRow
    open_ = [each for each in State if not each.ended]
    left = row.rollouts - run.rollouts_done - run.rollouts_saved
    counts = select(row.token_id, func.count()).where(row.state.in_(open_)).group_by(row.token_id)
    rollouts = (
        select(row.token_id, func.sum(case((left > 0, left), else_=0)))
        .join(run, run.experiment_id == row.id)
        .where(row.state.in_(open_), run.state.in_(open_))
        .group_by(row.token_id)
    )
    sums = {token: int(found) for token, found in session.execute(rollouts)}
    return {token: Load(count, sums.get(token, 0)) for token, count in session.execute(counts)}
