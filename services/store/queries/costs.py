"""Rollouts and their time, by experiment."""

from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from gaplab.services.store.models import ExperimentRow, RepetitionRow


def latest(session: Session, count: int) -> tuple[tuple[dict[str, Any], float, int], ...]:
    """Return spec, seconds of work and rollouts of the `count` newest experiments that have started."""
    row, run = ExperimentRow, RepetitionRow
    newest = (
        select(row.id, row.spec)
        .where(row.started_at.is_not(None))
        .order_by(row.created_at.desc(), row.position.desc(), row.id.desc())
        .limit(count)
    )
    specs: dict[str, dict[str, Any]] = dict(session.execute(newest).all())
    sums = (
        select(run.experiment_id, func.sum(run.seconds), func.sum(run.rollouts_done))
        .where(run.experiment_id.in_(list(specs)))
        .group_by(run.experiment_id)
    )
    found = {id_: (float(seconds), int(rollouts)) for id_, seconds, rollouts in session.execute(sums)}
    return tuple((spec, *found[id_]) for id_, spec in specs.items() if id_ in found)
