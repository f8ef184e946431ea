"""The log of a repetition: steps are appended in one transaction, and one that is there already stays as it is."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar, cast

from sqlalchemy import ColumnElement, Table, and_, bindparam, select, tuple_, update
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.services.core.errors import Conflict
from gaplab.services.core.types import Probed, Step
from gaplab.services.store import mapping
from gaplab.services.store.clock import now
from gaplab.services.store.lease import Checkpoint, Claim, Delivered, TimedStep
from gaplab.services.store.models import IterationRow, MeasurementRow, RepetitionRow, SimulatorRow
from gaplab.services.store.queries import checkpoints, events
from gaplab.services.store.queries.batch import Batch

_REPETITION = cast("Table", RepetitionRow.__table__)

_ADVANCE = (
    update(_REPETITION)
    .where(
        _REPETITION.c.id == bindparam("of_id"),
        _REPETITION.c.epoch == bindparam("of_epoch"),
        _REPETITION.c.state == State.RUNNING,
        _REPETITION.c.steps == bindparam("from_steps"),
    )
    .values(
        steps=bindparam("to_steps"),
        checkpoints=0,
        losses=0,
        heartbeat_at=now(),
        iterations_done=_REPETITION.c.iterations_done + bindparam("more_iterations"),
        rollouts_done=_REPETITION.c.rollouts_done + bindparam("more_rollouts"),
        rollouts_failed=_REPETITION.c.rollouts_failed + bindparam("more_failures"),
        rollouts_saved=_REPETITION.c.rollouts_saved + bindparam("more_saved"),
        seconds=_REPETITION.c.seconds + bindparam("more_seconds"),
    )
)
"""Built once: for a database that is asked little, to build a statement costs more than to execute it."""

R = TypeVar("R", IterationRow, MeasurementRow, SimulatorRow)


def mine(claim: Claim) -> ColumnElement[bool]:
    """That the claim still holds; goes into the WHERE of every write."""
    row = RepetitionRow
    return and_(row.id == claim.repetition_id, row.epoch == claim.epoch, row.state == State.RUNNING)


def any_of(claims: Sequence[Claim]) -> ColumnElement[bool]:
    """That a lease is one of these claims'; with `state = RUNNING`, that it still holds."""
    row = RepetitionRow
    return tuple_(row.id, row.epoch).in_([(each.repetition_id, each.epoch) for each in claims])


def record(session: Session, deliveries: Mapping[Claim, Sequence[Delivered]]) -> tuple[Claim, ...]:
    """Append the steps to the logs of their repetitions; the claims that still hold, which alone were written.

    The row of a repetition is guard and counter at once: it moves on if the claim holds and its next step is the first
    that is new, and whoever does not move it writes nothing. Checkpoints are kept until their step is appended.

    Raises:
        Conflict: steps before a delivered one are missing.
    """
    lengths = _lengths(session, deliveries)
    fresh = {claim: _new(claim, lengths[claim][0], each) for claim, each in deliveries.items() if claim in lengths}
    moving = [_move(claim, lengths[claim][0], steps) for claim, steps in fresh.items() if steps]
    if moving and session.connection().execute(_ADVANCE, moving).rowcount != len(moving):
        msg = "a log moved on although it was locked"
        raise Conflict(msg)
    batch = Batch()
    for claim, steps in fresh.items():
        for each in steps:
            batch.add(claim, each)
    batch.write(session)
    checkpoints.forget(session, [claim.repetition_id for claim, steps in fresh.items() if steps and lengths[claim][1]])
    checkpoints.write(
        session, {claim: _parts(deliveries[claim], *lengths[claim], len(fresh[claim])) for claim in fresh}
    )
    events.note_steps(session, fresh)
    return tuple(fresh)


def logs(session: Session, repetitions: Sequence[int]) -> dict[int, tuple[Step, ...]]:
    """The log of each of these repetitions."""
    iterations = _rows(session, repetitions, IterationRow, IterationRow.number)
    measurements = _rows(session, repetitions, MeasurementRow, MeasurementRow.iteration)
    simulators = _rows(session, repetitions, SimulatorRow, SimulatorRow.iteration, SimulatorRow.rank)
    return {each: mapping.log(iterations[each], measurements[each], simulators[each]) for each in repetitions}


def _lengths(session: Session, claims: Iterable[Claim]) -> dict[Claim, tuple[int, int]]:
    """How many steps the log of each claim that holds has, and checkpoints of the next; locked for the transaction."""
    by_key = {(each.repetition_id, each.epoch): each for each in claims}
    row = RepetitionRow
    found = session.execute(
        select(row.id, row.epoch, row.steps, row.checkpoints)
        .where(tuple_(row.id, row.epoch).in_(list(by_key)), row.state == State.RUNNING)
        .order_by(row.id)
        .with_for_update()
    )
    return {by_key[repetition, epoch]: (steps, parts) for repetition, epoch, steps, parts in found}


def _new(claim: Claim, length: int, delivered: Iterable[Delivered]) -> list[TimedStep]:
    """The steps that the log does not have yet: those after its first `length`."""
    found: list[TimedStep] = []
    for each in delivered:
        if isinstance(each, Checkpoint):
            continue
        place, following = mapping.position(each.step), length + len(found)
        if place > following:
            msg = f"step {place} of repetition {claim.number} cannot be recorded: the log has {following} steps"
            raise Conflict(msg)
        if place == following:
            found.append(each)
    return found


def _parts(delivered: Iterable[Delivered], length: int, parts: int, new: int) -> list[Checkpoint]:
    """The delivered checkpoints of the step that is under way once the log has its new steps."""
    found = [each for each in delivered if isinstance(each, Checkpoint)]
    return checkpoints.fresh(found, length + new, 0 if new else parts)


def _move(claim: Claim, length: int, steps: Sequence[TimedStep]) -> dict[str, Any]:
    costs = [mapping.cost(each.step) for each in steps]
    return {
        "of_id": claim.repetition_id,
        "of_epoch": claim.epoch,
        "from_steps": length,
        "to_steps": length + len(steps),
        "more_iterations": sum(isinstance(each.step, Probed) for each in steps),
        "more_rollouts": sum(int(each.rollouts) for each in costs),
        "more_failures": sum(int(each.failures) for each in costs),
        "more_saved": sum(int(each.saved) for each in costs),
        "more_seconds": sum(each.seconds for each in steps),
    }


def _rows(session: Session, repetitions: Sequence[int], table: type[R], *order: Any) -> dict[int, list[R]]:  # noqa: ANN401  # columns
    found: Iterable[R] = session.scalars(select(table).where(table.repetition_id.in_(repetitions)).order_by(*order))
    gathered: dict[int, list[R]] = defaultdict(list)
    for row in found:
        gathered[row.repetition_id].append(row)
    return gathered
