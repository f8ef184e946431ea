"""The log of a repetition: one transaction records one step, and a step that is there already stays as it is."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, and_, insert, select, update
from sqlalchemy.orm import Session

from schemas.lifecycle import State
from schemas.records import MeasurementKind
from services.core.errors import Conflict
from services.core.types import Measured, Probed, Step, Tuned
from services.store import mapping
from services.store.clock import now
from services.store.lease import Claim
from services.store.models import IterationRow, MeasurementRow, RepetitionRow, SimulatorRow

R = TypeVar("R", IterationRow, MeasurementRow, SimulatorRow)


def mine(claim: Claim) -> ColumnElement[bool]:
    """That the claim still holds; goes into the WHERE of every write."""
    row = RepetitionRow
    return and_(row.id == claim.repetition_id, row.epoch == claim.epoch, row.state == State.RUNNING)


def record(session: Session, claim: Claim, step: Step, *, seconds: float, measured_by: str) -> bool:
    """Append the step to the log; False if the claim holds no more.

    The row of the repetition is guard and counter at once: it moves on by one step if the claim holds and this step is
    the next one, and whoever does not move it writes nothing.

    Raises:
        Conflict: steps before this one are missing.
    """
    if not _advance(session, claim, step, seconds):
        return _is_there(session, claim, step)
    key = {"repetition_id": claim.repetition_id}
    _write_iteration(session, key, step, seconds)
    if isinstance(step, Tuned) and step.simulators:
        rows = [key | {"iteration": step.iteration} | columns for columns in mapping.simulator_columns(step)]
        session.execute(insert(SimulatorRow), rows)
    if isinstance(step, Measured | Probed):
        _write_measurement(session, key, step, measured_by)
    return True


def logs(session: Session, repetitions: Sequence[int]) -> dict[int, tuple[Step, ...]]:
    """The log of each of these repetitions."""
    iterations = _rows(session, repetitions, IterationRow, IterationRow.number)
    measurements = _rows(session, repetitions, MeasurementRow, MeasurementRow.iteration)
    simulators = _rows(session, repetitions, SimulatorRow, SimulatorRow.iteration, SimulatorRow.rank)
    return {each: mapping.log(iterations[each], measurements[each], simulators[each]) for each in repetitions}


def _advance(session: Session, claim: Claim, step: Step, seconds: float) -> bool:
    row, place, cost = RepetitionRow, mapping.position(step), mapping.cost(step)
    advanced = session.execute(
        update(row)
        .where(mine(claim), row.steps == place)
        .values(
            steps=place + 1,
            losses=0,
            heartbeat_at=now(),
            iterations_done=row.iterations_done + int(isinstance(step, Probed)),
            rollouts_done=row.rollouts_done + int(cost.rollouts),
            rollouts_failed=row.rollouts_failed + int(cost.failures),
            rollouts_saved=row.rollouts_saved + int(cost.saved),
            seconds=row.seconds + seconds,
        )
        .returning(row.id)
    )
    return advanced.first() is not None


def _is_there(session: Session, claim: Claim, step: Step) -> bool:
    """Whether the step was recorded under this claim's eyes: True for a second delivery, False for a lost claim."""
    steps = session.scalar(select(RepetitionRow.steps).where(mine(claim)))
    if steps is None:
        return False
    if steps < (place := mapping.position(step)):
        msg = f"step {place} of repetition {claim.number} cannot be recorded: the log has {steps} steps"
        raise Conflict(msg)
    return True


def _write_iteration(session: Session, key: dict[str, int], step: Step, seconds: float) -> None:
    row, columns = IterationRow, mapping.iteration_columns(step)
    if mapping.opens_iteration(step):
        session.execute(insert(row).values(**key, number=step.iteration, seconds=seconds, **columns))
        return
    ended = {"ended_at": now()} if isinstance(step, Probed) else {}
    session.execute(
        update(row)
        .where(row.repetition_id == key["repetition_id"], row.number == step.iteration)
        .values(seconds=row.seconds + seconds, **columns, **ended)
    )


def _write_measurement(session: Session, key: dict[str, int], step: Measured | Probed, measured_by: str) -> None:
    if isinstance(step, Measured):
        kind, genome, fitness = MeasurementKind.SAMPLE, mapping.vector(step.sample.genome), step.sample.fitness
    else:
        kind, genome, fitness = MeasurementKind.PROBE, _transferred(session, key, step.iteration), step.fitness
    session.execute(
        insert(MeasurementRow).values(
            **key,
            iteration=step.iteration,
            kind=kind,
            genome=genome,
            fitness=mapping.finite(fitness),
            measured_by=measured_by,
        )
    )


def _transferred(session: Session, key: dict[str, int], iteration: int) -> list[float]:
    row = IterationRow
    where = (row.repetition_id == key["repetition_id"], row.number == iteration)
    return session.execute(select(row.transferred_genome).where(*where)).scalar_one() or []


def _rows(session: Session, repetitions: Sequence[int], table: type[R], *order: Any) -> dict[int, list[R]]:  # noqa: ANN401  # columns
    found: Iterable[R] = session.scalars(select(table).where(table.repetition_id.in_(repetitions)).order_by(*order))
    gathered: dict[int, list[R]] = defaultdict(list)
    for row in found:
        gathered[row.repetition_id].append(row)
    return gathered
