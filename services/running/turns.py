"""Turns: by priority, then by the fewest claimed repetitions, then by the longest wait since the last turn.

So the experiments of a study advance together, and a study that is stopped has something of each.

Claimed repetitions that still wait for a core count as running.
"""

from collections.abc import Sequence
from heapq import heapify, heappop, heapreplace

from sqlalchemy import ColumnElement, Select, func, select
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries.experiments import lock

_ROW = ExperimentRow
_ORDER = (_ROW.precedence, _ROW.running, _ROW.turn_at, _ROW.position, _ROW.id)

_HELD = select(RepetitionRow.hardware).where(RepetitionRow.hardware.is_not(None))

FREE_HARDWARE = _ROW.hardware.is_(None) | _ROW.hardware.not_in(_HELD)
"""That an experiment needs no hardware, or some that no repetition holds."""


def next_repetitions(session: Session, limit: int, permitted: ColumnElement[bool]) -> tuple[int, ...]:
    """Lock the experiments whose turn it is, and return up to `limit` of their queued repetitions in order."""
    experiments = session.scalars(next_experiments(limit).where(permitted)).all()
    if not experiments:
        return ()
    lock(session, experiments)
    turns = _turns(session, experiments, limit, permitted)
    waiting = {each: iter(_queued(session, each, turns.count(each))) for each in set(turns)}
    return tuple(next(waiting[each]) for each in turns)


def next_experiments(limit: int) -> Select[str]:
    """Select the experiments with the next turns from an index; no other can have one of the `limit` turns."""
    return select(_ROW.id).where(_ROW.claimable.is_(True)).order_by(*_ORDER).limit(limit)


def ahead(session: Session, experiments: Sequence[str], permitted: ColumnElement[bool]) -> frozenset[str]:
    """Return the experiments that should give up a claimed repetition for one of another permitted experiment."""
    waits = _ROW.claimable.is_(True) & permitted
    first = select(_ROW.precedence, _ROW.running).where(waits).order_by(*_ORDER).limit(1)
    if (waiting := session.execute(first).first()) is None:
        return frozenset()
    held = select(_ROW.id, _ROW.precedence, _ROW.running).where(_ROW.id.in_(experiments))
    return frozenset(
        experiment
        for experiment, precedence, running in session.execute(held)
        if (waiting.precedence, waiting.running + 1) < (precedence, running)
    )


def _turns(session: Session, experiments: Sequence[str], limit: int, permitted: ColumnElement[bool]) -> list[str]:
    """Return the experiment of each turn; each turn gives its experiment one more running repetition.

    The experiments are locked, so this reads again which of them are claimable and permitted.
    """
    row = RepetitionRow
    queued = (
        select(row.experiment_id, func.count().label("queued"))
        .where(row.experiment_id.in_(experiments), row.state == State.QUEUED)
        .group_by(row.experiment_id)
        .subquery()
    )
    candidates = session.execute(
        select(_ROW.id, _ROW.precedence, _ROW.running, _ROW.max_parallel, queued.c.queued, _ROW.hardware)
        .join(queued, queued.c.experiment_id == _ROW.id)
        .where(_ROW.claimable.is_(True), permitted)
        .order_by(_ROW.turn_at, _ROW.position, _ROW.id)
    ).all()
    heap = [
        (precedence, running, place, min(waiting, waiting if most is None else most - running))
        for place, (_, precedence, running, most, waiting, _) in enumerate(candidates)
    ]
    heapify(heap)
    turns: list[str] = []
    used: set[str] = set()
    while heap and len(turns) < limit:
        precedence, running, place, room = heap[0]
        if (hardware := candidates[place].hardware) in used:
            heappop(heap)
            continue
        turns.append(candidates[place].id)
        used |= {hardware} - {None}
        if room > 1:
            heapreplace(heap, (precedence, running + 1, place, room - 1))
        else:
            heappop(heap)
    return turns


def _queued(session: Session, experiment: str, limit: int) -> Sequence[int]:
    row = RepetitionRow
    queued = select(row.id).where(row.experiment_id == experiment, row.state == State.QUEUED)
    return session.scalars(queued.order_by(row.number).limit(limit)).all()
