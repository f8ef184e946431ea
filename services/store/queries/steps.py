"""Writing of repetitions' logs: steps are appended in one transaction, and a recorded step never changes."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, cast

from sqlalchemy import Table, bindparam, func, insert, select, tuple_, update
from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import State
from gaplab.services.core.errors import Conflict
from gaplab.services.core.types import LENGTH, Cost, Measured, Probed, Step, may_follow, next_place, place_of
from gaplab.services.store.clock import now
from gaplab.services.store.lease import Claim, Delivered, TimedStep
from gaplab.services.store.models import LOG, RepetitionRow, StepKind, StepRow
from gaplab.services.store.queries import checkpoints, events
from gaplab.services.store.queries.logs import columns_of, logs

_REPETITION, _STEP = (cast("Table", each.__table__) for each in (RepetitionRow, StepRow))

_TALLIES = {"rollouts_done": "rollouts", "rollouts_failed": "failures", "rollouts_saved": "saved"}
"""Columns of a repetition, and those of its steps whose sums they are."""

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
        losses=0,
        measuring_at=None,
        heartbeat_at=now(),
        **{name: _REPETITION.c[name] + bindparam(f"more_{name}") for name in (*_TALLIES, "seconds")},
    )
)
"""Built once: building a statement costs more than executing it."""


def record(session: Session, deliveries: Mapping[Claim, Sequence[Delivered]]) -> dict[Claim, int]:
    """Append steps to the logs of repetitions, and return the number of new steps by claim that is still valid.

    The row of a repetition is guard and counter at once. It advances if the claim is valid and the first new step is
    the next one; otherwise nothing is written. Checkpoints are kept until their step is appended.

    Raises:
        Conflict: steps before a delivered one are missing.
    """
    lengths = _lengths(session, deliveries)
    fresh = {claim: _new(claim, lengths[claim][0], each) for claim, each in deliveries.items() if claim in lengths}
    moving = [_move(claim, lengths[claim][0], steps) for claim, steps in fresh.items() if steps]
    if moving and session.connection().execute(_ADVANCE, moving).rowcount != len(moving):
        raise Conflict("a log has new steps although it was locked")
    engines = {claim: claim.spec.reality.engine for claim in fresh}
    by = {claim: engine.name if engine else "nobody" for claim, engine in engines.items()}
    rows = [_row(claim.id, each, by[claim]) for claim, steps in fresh.items() for each in steps]
    if rows:
        session.connection().execute(insert(_STEP), rows)
    for claim, steps in fresh.items():
        for each in steps:
            events.note_step(session, each.step, claim.experiment_id, claim.number)
    checkpoints.forget(session, [claim.id for claim, steps in fresh.items() if steps and lengths[claim][1]])
    parts = {
        claim: checkpoints.fresh(deliveries[claim], lengths[claim][0] + len(steps), 0 if steps else lengths[claim][1])
        for claim, steps in fresh.items()
    }
    checkpoints.write(session, parts)
    return {claim: len(steps) for claim, steps in fresh.items()}


def append(session: Session, repetition: RepetitionRow, timed: TimedStep, measured_by: str) -> None:
    """Append the next step to the log of a repetition that no worker holds.

    Raises:
        Conflict: a worker holds it, it has ended, or the step is not the next one.
    """
    if repetition.state not in (State.WAITING, State.QUEUED) or not may_follow(timed.step, repetition.steps):
        msg = f"step {place_of(timed.step)} cannot be recorded: repetition {repetition.number} is {repetition.state} "
        raise Conflict(msg + f"after {repetition.steps} steps")
    session.connection().execute(insert(_STEP), [_row(repetition.id, timed, measured_by)])
    row = RepetitionRow
    values = {"steps": place_of(timed.step) + 1, "losses": 0, "error": None}
    session.execute(update(row).where(row.id == repetition.id).values(values))
    events.note_step(session, timed.step, repetition.experiment_id, repetition.number)


def close(session: Session, repetition: int, place: int, branch: int, kept: Sequence[int] = ()) -> None:
    """Move the steps of a log from a place on into a branch; they count nowhere from then on.

    The samples of the `kept` iterations stay, as samples that were told: they follow what is before the place.
    """
    row, (log,) = StepRow, logs(session, [repetition]).values()
    of_it = (row.repetition_id == repetition) & (row.branch == LOG)
    sample = row.kind.in_((StepKind.SELECTED, StepKind.MEASURED)) & row.iteration.in_(kept)
    session.execute(update(row).where(of_it, row.place >= place, ~sample).values(branch=branch))
    for old, new in renumbered(place, kept):
        pair = [place_of(step) for step in log if step.iteration == old][:2]
        moved = {"iteration": new, "place": row.place + (new - old) * LENGTH}
        session.execute(update(row).where(of_it, row.iteration == old, row.place.in_(pair)).values(moved))
        chosen = select(row).where(of_it, row.iteration == new, row.kind == StepKind.SELECTED)
        selected = session.scalars(chosen, execution_options={"populate_existing": True}).one()
        selected.body = selected.body | {"told": True}
    session.flush()
    (left,) = logs(session, [repetition]).values()
    sums = (func.coalesce(func.sum(getattr(row, name)), 0) for name in (*_TALLIES.values(), "seconds"))
    found = session.execute(select(*sums).where(of_it)).one()
    values = dict(zip((*_TALLIES, "seconds"), found, strict=True))
    session.execute(
        update(RepetitionRow).where(RepetitionRow.id == repetition).values(steps=next_place(left), **values)
    )


def renumbered(place: int, kept: Sequence[int]) -> list[tuple[int, int]]:
    """Return the old and the new iteration of samples that stay in a log when the steps from a place on leave it."""
    first = (place + LENGTH + 1) // LENGTH
    return list(zip(sorted(kept), range(first, first + len(kept)), strict=True))


def rewrite(session: Session, repetition: int, step: Step, measured_by: str | None = None) -> None:
    """Write the outcome of a measurement into its row; who measured it stays unless it is given."""
    columns, row = columns_of(step), StepRow
    values = {name: columns[name] for name in ("fitness", "recorded", "body")}
    values |= {} if measured_by is None else {"measured_by": measured_by}
    of_it = (row.repetition_id == repetition) & (row.branch == LOG) & (row.kind == columns["kind"])
    session.execute(update(row).where(of_it, row.iteration == step.iteration).values(values))


def _row(repetition: int, timed: TimedStep, measured_by: str) -> dict[str, Any]:
    step = timed.step
    measured = isinstance(step, Measured) or (isinstance(step, Probed) and not step.left_out)
    own = {"repetition_id": repetition, "seconds": timed.seconds, "measured_by": measured_by if measured else None}
    return own | columns_of(step)


def _lengths(session: Session, claims: Iterable[Claim]) -> dict[Claim, tuple[int, int]]:
    """Lock the repetitions whose claims are valid; return their numbers of steps, and of checkpoints of the next."""
    by_key: dict[tuple[int, int, str | None], Claim] = {(each.id, each.epoch, each.owner): each for each in claims}
    row = RepetitionRow
    found = session.execute(
        select(row.id, row.epoch, row.owner, row.steps, row.checkpoints)
        .where(tuple_(row.id, row.epoch, row.owner).in_(list(by_key)), row.state == State.RUNNING)
        .order_by(row.id)
        .with_for_update()
    )
    return {by_key[id_, epoch, owner]: (steps, parts) for id_, epoch, owner, steps, parts in found}


def _new(claim: Claim, length: int, delivered: Iterable[Delivered]) -> list[TimedStep]:
    """Return the delivered steps that follow the first `length` of the log."""
    found: list[TimedStep] = []
    for each in delivered:
        if not isinstance(each, TimedStep):
            continue
        place, following = place_of(each.step), length + len(found)
        if place > following:
            msg = f"step {place} of repetition {claim.number} cannot be recorded: the log has {following} steps"
            raise Conflict(msg)
        if place == following:
            found.append(each)
    return found


def _move(claim: Claim, length: int, steps: Sequence[TimedStep]) -> dict[str, Any]:
    costs = [getattr(each.step, "cost", Cost()) for each in steps]
    return {
        "of_id": claim.id,
        "of_epoch": claim.epoch,
        "from_steps": length,
        "to_steps": length + len(steps),
        "more_seconds": sum(each.seconds for each in steps),
        **{f"more_{name}": sum(int(getattr(each, of)) for each in costs) for name, of in _TALLIES.items()},
    }
