"""Closed branches: the steps after a corrected measurement leave the log, and stay readable."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from sqlalchemy import delete, func, insert, literal, select, update

from gaplab.schemas.corrections import BranchRead
from gaplab.schemas.lifecycle import Ending, State
from gaplab.services.core.arrays import known
from gaplab.services.core.types import Measured, Probed, Selected, Step, Transferred, Tuned
from gaplab.services.running.leases import Change
from gaplab.services.running.repetition_leases import RepetitionLeases
from gaplab.services.store.clock import now
from gaplab.services.store.models import (
    BranchRow,
    IterationRow,
    MeasurementRow,
    RepetitionRow,
    RequestRow,
    SimulatorRow,
)
from gaplab.services.store.queries import checkpoints, request_states
from gaplab.services.store.queries.experiments import get_experiment
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.queries.step_rows import iteration_columns, position, tallied, vector
from gaplab.services.store.session import Session, snapshot

_LEASES = RepetitionLeases()


def close(session: Session, repetition: RepetitionRow, place: int, iteration: int, reason: str) -> int | None:
    """Close the steps of a log from a place on, and return the number of their branch; None if no step is closed.

    A worker that computes further steps loses its lease. The caller has locked the experiment, and settles it.
    `iteration` is that of the measurement that was corrected.
    """
    if repetition.state is State.RUNNING:
        given_up = Change(State.QUEUED, Ending.HANDED_BACK, "a measurement was corrected", {"owner": None})
        _LEASES.end(session, RepetitionRow.id == repetition.id, given_up)
        session.refresh(repetition)
    (log,) = logs(session, [repetition.id]).values()
    closed = log[place:]
    checkpoints.forget(session, [repetition.id])
    if not closed:
        _withdraw(session, repetition.id, place, None)
        return None
    of_it = select(func.max(BranchRow.number)).where(BranchRow.repetition_id == repetition.id)
    number = 1 + (session.scalar(of_it) or 0)
    values = {"repetition_id": repetition.id, "number": number, "iteration": iteration, "reason": reason}
    session.execute(insert(BranchRow).values(**values, steps=[plain(step) for step in closed], closed_at=now()))
    _withdraw(session, repetition.id, place, number)
    _count_down(session, repetition.id, place, closed)
    _remove(session, repetition.id, closed)
    session.refresh(repetition)
    return number


def plain(step: Step) -> dict[str, Any]:
    """Return a step as JSON."""
    found: dict[str, Any] = {"kind": type(step).__name__.lower(), "iteration": step.iteration}
    match step:
        case Selected():
            found["genome"] = vector(step.genome)
        case Measured():
            sample = step.sample
            found |= {"genome": vector(sample.genome), "fitness": known(sample.fitness)}
            found["repeats"] = vector(sample.repeats)
        case Tuned():
            found["simulators"] = [
                {"parameters": vector(each.parameters), "squared_error": known(each.squared_error)}
                for each in step.simulators
            ]
        case Transferred():
            found |= {"genome": vector(step.genome), "simulated_fitness": known(step.fitness)}
        case Probed():
            found |= {"fitness": known(step.fitness), "recorded_fitness": known(step.recorded)}
            found["repeats"] = vector(step.repeats)
    return found


@snapshot
def list_branches(session: Session, experiment: str) -> tuple[BranchRead, ...]:
    """Return the closed branches of an experiment, by repetition and number.

    Raises:
        NotFound: the experiment does not exist.
    """
    get_experiment(session, experiment)
    row, repetition = BranchRow, RepetitionRow
    query = select(row, repetition.number).join(repetition, repetition.id == row.repetition_id)
    found = session.execute(query.where(repetition.experiment_id == experiment).order_by(repetition.number, row.number))
    return tuple(BranchRead.filled_from(each, repetition=number) for each, number in found)


def _withdraw(session: Session, repetition: int, place: int, branch: int | None) -> None:
    """Withdraw what the closed steps still wait for, and say of the answered requests that they are of the branch."""
    row = RequestRow
    later = (row.repetition_id == repetition) & (row.place >= place) & row.branch.is_(None)
    request_states.withdraw(session, later)
    session.execute(update(row).where(later).values(branch=branch))


def _remove(session: Session, repetition: int, closed: Sequence[Step]) -> None:
    """Delete the rows of closed steps, and empty the columns of iterations that keep earlier steps."""
    measurement, simulator, iteration = MeasurementRow, SimulatorRow, IterationRow
    opened = _whole(closed)
    for step in closed:
        number = step.iteration
        if isinstance(step, Measured | Probed):
            kind = "sample" if isinstance(step, Measured) else "probe"
            of_it = (measurement.repetition_id == repetition) & (measurement.iteration == number)
            session.execute(delete(measurement).where(of_it, measurement.kind == kind))
        if isinstance(step, Tuned):
            of_it = (simulator.repetition_id == repetition) & (simulator.iteration == number)
            session.execute(delete(simulator).where(of_it))
        if number not in opened:
            of_it = (iteration.repetition_id == repetition) & (iteration.number == number)
            emptied = dict.fromkeys([*iteration_columns(step), "ended_at"])
            session.execute(update(iteration).where(of_it).values(emptied))
    if opened:
        session.execute(delete(iteration).where(iteration.repetition_id == repetition, iteration.number.in_(opened)))


def _whole(closed: Sequence[Step]) -> set[int]:
    return {step.iteration for step in closed if isinstance(step, Selected) or position(step) == 0}


def _count_down(session: Session, repetition: int, place: int, closed: Sequence[Step]) -> None:
    """Take closed steps out of the tallies of their repetition, and their seconds out of their iterations.

    Seconds of an iteration that keeps steps are shared by rollouts, since those of single steps are not stored.
    """
    row, seconds = RepetitionRow, _seconds_of(session, repetition, closed)
    iteration = IterationRow
    for number, spent in seconds.items():
        of_it = (iteration.repetition_id == repetition) & (iteration.number == number)
        session.execute(update(iteration).where(of_it).values(seconds=iteration.seconds - spent))
    values = {
        "seconds": row.seconds - sum(seconds.values()),
        "steps": place,
        **{name: getattr(row, name) - count for name, count in tallied(closed).items()},
    }
    session.execute(update(row).where(row.id == repetition).values(values))


def _seconds_of(session: Session, repetition: int, closed: Sequence[Step]) -> dict[int, float]:
    row, whole, rollouts = IterationRow, _whole(closed), Counter[int]()
    for step in closed:
        rollouts[step.iteration] += tallied([step])["rollouts_done"]
    parts = (row.selection_rollouts, row.tuning_rollouts, row.transfer_rollouts)
    every = sum((func.coalesce(part, 0) for part in parts), start=literal(0))
    query = select(row.number, row.seconds, every).where(row.repetition_id == repetition, row.number.in_(rollouts))
    return {
        number: seconds if number in whole else seconds * rollouts[number] / max(count, 1)
        for number, seconds, count in session.execute(query)
    }
