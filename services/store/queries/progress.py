"""The progress of experiments: sums over their repetitions, independent of the number of results."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from datetime import datetime
from functools import cache
from typing import Any

from sqlalchemy import ColumnElement, Select, bindparam, case, func, select
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import PENDING, State
from gaplab.schemas.records import StepRead
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries import checkpoints

_STOPPED = (State.COMPLETED, State.CANCELLED)


@dataclass(frozen=True)
class Tally:
    """Sums over the repetitions of an experiment or a study.

    Attributes:
        running: repetitions with a stored step; a claimed repetition without one may still wait for a core.
        stopped: repetitions that ended before their last iteration without failing.
        counted_iterations, counted_iterations_done: iterations without number 0.
        rollouts_left: remaining rollouts of repetitions that have not ended.
        seconds: seconds of work in the completed rollouts.
        steps: what its repetitions have begun; the rollouts of those count.
        spans: begin and end of the work on it, if that is asked for.
    """

    repetitions: int = 0
    completed: int = 0
    failed: int = 0
    running: int = 0
    stopped: int = 0
    iterations: int = 0
    iterations_done: int = 0
    counted_iterations: int = 0
    counted_iterations_done: int = 0
    rollouts: int = 0
    rollouts_done: int = 0
    rollouts_failed: int = 0
    rollouts_saved: int = 0
    rollouts_left: int = 0
    seconds: float = 0.0
    steps: tuple[StepRead, ...] = ()
    spans: tuple[tuple[datetime, datetime], ...] = ()

    def __add__(self, other: "Tally") -> "Tally":
        return Tally(*(mine + theirs for mine, theirs in zip(vars(self).values(), vars(other).values(), strict=True)))


def tallies(session: Session, experiments: Sequence[str]) -> dict[str, Tally]:
    """Return the tally of each experiment."""
    found = session.execute(_all_tallies(), {"experiments": experiments})
    tallied: dict[str, Tally] = {}
    for experiment, *counts, seconds in found:  # as int: Postgres returns decimals
        named: dict[str, Any] = {each.name: int(count) for each, count in zip(fields(Tally), counts, strict=False)}
        tallied[experiment] = Tally(seconds=float(seconds), **named)
    for experiment, step in checkpoints.begun(session, experiments):
        tallied[experiment] += Tally(rollouts_done=step.rollouts, rollouts_left=-step.rollouts, steps=(step,))
    return tallied


@cache
def _all_tallies() -> Select[*tuple[Any, ...]]:
    """Return the query for the tallies of `experiments`; cached, because every list asks it and it is long."""
    row = RepetitionRow
    left = ExperimentRow.rollouts - row.rollouts_done - row.rollouts_saved
    return (
        select(
            row.experiment_id,
            func.count(),
            _count(row.state == State.COMPLETED),
            _count(row.state == State.FAILED),
            _count((row.state == State.RUNNING) & (row.steps > 0)),
            _count(row.state.in_(_STOPPED) & (row.iterations_done < ExperimentRow.iterations)),
            func.sum(ExperimentRow.iterations),
            func.sum(row.iterations_done),
            func.sum(ExperimentRow.iterations - 1),
            func.sum(case((row.iterations_done > 0, row.iterations_done - 1), else_=0)),
            func.sum(ExperimentRow.rollouts),
            func.sum(row.rollouts_done),
            func.sum(row.rollouts_failed),
            func.sum(row.rollouts_saved),
            func.sum(case(((left > 0) & row.state.in_(PENDING), left), else_=0)),
            func.sum(row.seconds),
        )
        .join(ExperimentRow, ExperimentRow.id == row.experiment_id)
        .where(row.experiment_id.in_(bindparam("experiments", expanding=True)))
        .group_by(row.experiment_id)
    )


def most_done(session: Session, experiments: Sequence[str]) -> dict[str, int]:
    """Return the iterations, number 0 included, that the farthest repetition of each experiment has completed."""
    row = RepetitionRow
    query = select(row.experiment_id, func.max(row.iterations_done)).where(row.experiment_id.in_(experiments))
    return dict(session.execute(query.group_by(row.experiment_id)).all())


def reasons(session: Session, experiments: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return the distinct errors of failed repetitions, by experiment, in the order of repetitions."""
    row = RepetitionRow
    found = session.execute(
        select(row.experiment_id, row.error)
        .where(row.experiment_id.in_(experiments), row.state == State.FAILED, row.error.is_not(None))
        .group_by(row.experiment_id, row.error)
        .order_by(row.experiment_id, func.min(row.number))
    )
    gathered: dict[str, tuple[str, ...]] = {}
    for experiment, reason in found:
        gathered[experiment] = (*gathered.get(experiment, ()), str(reason))
    return gathered


def _count(condition: ColumnElement[bool]) -> ColumnElement[int]:
    return func.sum(case((condition, 1), else_=0))
