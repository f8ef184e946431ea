"""The fitness of all experiments, grouped for conditions of queries."""

from typing import Any

from sqlalchemy import ColumnElement, Select, func, select

from gaplab.services.store.models import IterationRow, RepetitionRow
from gaplab.services.store.queries.results import last_common_of_all


def points_of_all() -> tuple[Select[Any], ColumnElement[Any]]:
    """Return the ids of experiments with a fitness after the last common number, grouped, and that of a repetition."""
    row, shared = IterationRow, last_common_of_all().subquery()
    query = select(RepetitionRow.experiment_id).join(shared, shared.c.experiment_id == RepetitionRow.experiment_id)
    query = query.join(row, (row.repetition_id == RepetitionRow.id) & (row.number == shared.c.done - 1))
    return query.where(row.recorded_fitness.is_not(None)).group_by(
        RepetitionRow.experiment_id
    ), row.recorded_fitness.expression


def best_of_all() -> tuple[Select[Any], ColumnElement[Any]]:
    """Return the ids of experiments with a recorded fitness, grouped, and the best of a repetition in these groups."""
    best = (
        select(RepetitionRow.experiment_id, func.max(IterationRow.recorded_fitness).label("best"))
        .join(IterationRow, IterationRow.repetition_id == RepetitionRow.id)
        .where(IterationRow.recorded_fitness.is_not(None))
        .group_by(RepetitionRow.id, RepetitionRow.experiment_id)
        .subquery()
    )
    return select(best.c.experiment_id).group_by(best.c.experiment_id), best.c.best
