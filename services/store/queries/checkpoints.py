"""Checkpoints of current steps: stored in parts, read with a claim, deleted when the step is recorded."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence

from sqlalchemy import bindparam, delete, insert, select, update
from sqlalchemy.orm import Session

from gaplab.schemas.records import StepRead
from gaplab.services.core.errors import Conflict
from gaplab.services.store.clock import now
from gaplab.services.store.lease import Checkpoint, Claim, Delivered
from gaplab.services.store.models import CheckpointRow, RepetitionRow
from gaplab.services.store.queries.experiments import of_experiments

_COLUMNS = tuple(Checkpoint.__dataclass_fields__)
_KINDS = ("selection", "measurement", "tuning", "transfer", "probe")


def fresh(delivered: Iterable[Delivered], step: int, parts: int) -> list[Checkpoint]:
    """Return the delivered parts of the current step, at its place in the log, that follow the stored parts.

    Raises:
        Conflict: parts or steps before a delivered part are missing.
    """
    found: list[Checkpoint] = []
    for each in (item for item in delivered if isinstance(item, Checkpoint)):
        following = parts + len(found)
        if each.step > step or (each.step == step and each.part > following):
            msg = f"part {each.part} of step {each.step} cannot be stored: next is part {following} of step {step}"
            raise Conflict(msg)
        if each.step == step and each.part == following:
            found.append(each)
    return found


def write(session: Session, parts: Mapping[Claim, Sequence[Checkpoint]]) -> None:
    """Store parts of current steps. The repetitions must be locked, and the claims valid."""
    rows = [
        {"repetition_id": claim.id} | {name: getattr(each, name) for name in _COLUMNS}
        for claim, checkpoints in parts.items()
        for each in checkpoints
    ]
    if not rows:
        return
    session.execute(insert(CheckpointRow), rows)
    counts = [
        {"of_id": claim.id, "count": checkpoints[-1].part + 1} for claim, checkpoints in parts.items() if checkpoints
    ]
    row = RepetitionRow
    counted = {"checkpoints": bindparam("count"), "losses": 0, "heartbeat_at": now()}
    session.connection().execute(update(row).where(row.id == bindparam("of_id")).values(counted), counts)


def forget(session: Session, repetitions: Sequence[int]) -> None:
    """Delete the checkpoints of repetitions whose step was recorded or given up; the next one is number 0 again."""
    if repetitions:
        session.execute(delete(CheckpointRow).where(CheckpointRow.repetition_id.in_(repetitions)))
        session.execute(update(RepetitionRow).where(RepetitionRow.id.in_(repetitions)).values(checkpoints=0))


def stored(session: Session, repetitions: Sequence[int]) -> dict[int, tuple[Checkpoint, ...]]:
    """Return the stored parts of the current step, by repetition."""
    row = CheckpointRow
    found = session.scalars(select(row).where(row.repetition_id.in_(repetitions)).order_by(row.step, row.part))
    gathered: dict[int, list[Checkpoint]] = defaultdict(list)
    for each in found:
        gathered[each.repetition_id].append(Checkpoint(*(getattr(each, name) for name in _COLUMNS)))
    return {each: tuple(gathered[each]) for each in repetitions}


def begun(session: Session, experiments: Sequence[str]) -> Iterator[tuple[str, StepRead]]:
    """Yield the steps that have checkpoints, each with its experiment."""
    row, of = CheckpointRow, RepetitionRow
    columns = of.experiment_id, of.number, row.step, row.rollouts, row.budget
    query = of_experiments(row, experiments, *columns).where(row.part == of.checkpoints - 1, row.budget > 0)
    for experiment, number, place, rollouts, budget in session.execute(query.order_by(of.number)):
        iteration, kind = kind_at(place)
        step = StepRead(repetition=number, iteration=iteration, kind=kind, rollouts=rollouts, budget=budget)
        yield experiment, step


def kind_at(place: int) -> tuple[int, str]:
    """Return the iteration of the step at a place of a log, and what it does."""
    iteration, kind = divmod(place + _KINDS.index("tuning"), len(_KINDS))
    return iteration, _KINDS[kind]
