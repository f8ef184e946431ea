"""Claims whose answer never arrived: the database gave them, and then the connection failed."""

from collections.abc import Sequence

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import Ending, State
from gaplab.services.store.lease import Claim
from gaplab.services.store.models import RepetitionRow
from gaplab.services.store.queries import attempts
from gaplab.services.store.queries.experiments import lock
from gaplab.services.store.queries.settling import settle


def hand_back(session: Session, owner: str, held: Sequence[Claim]) -> int:
    """What is the owner's, and is none of these claims, QUEUED again as if it had not been claimed; how many."""
    row = RepetitionRow
    unheard = (row.owner == owner) & (row.state == State.RUNNING) & row.id.not_in([each.repetition_id for each in held])
    experiments = session.scalars(select(row.experiment_id).where(unheard).distinct()).all()
    if not experiments:
        return 0
    lock(session, experiments)
    values = {"state": State.QUEUED, "owner": None, "attempts": row.attempts - 1}
    given = session.scalars(update(row).where(unheard).values(values).returning(row.id)).all()
    attempts.end(session, given, Ending.HANDED_BACK)
    settle(session, sorted(experiments))
    return len(given)
