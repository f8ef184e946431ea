"""Closed branches: the steps after a corrected measurement leave the log, and stay readable."""

from typing import Any

from sqlalchemy import func, insert, select, update

from gaplab.schemas.corrections import BranchRead
from gaplab.schemas.lifecycle import Ending, State
from gaplab.services.findings.event_sentences import step_sentence
from gaplab.services.running.leases import Change
from gaplab.services.running.repetition_leases import RepetitionLeases
from gaplab.services.store.models import BranchRow, RepetitionRow, RequestRow, StepKind, StepRow
from gaplab.services.store.queries import checkpoints, requests, steps
from gaplab.services.store.queries.experiments import get_experiment
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
    checkpoints.forget(session, [repetition.id])
    number = None
    if repetition.steps > place:
        of_it = select(func.max(BranchRow.number)).where(BranchRow.repetition_id == repetition.id)
        number = 1 + (session.scalar(of_it) or 0)
        values = {"repetition_id": repetition.id, "number": number, "iteration": iteration, "reason": reason}
        session.execute(insert(BranchRow).values(**values))
        steps.close(session, repetition.id, place, number)
        session.refresh(repetition)
    _withdraw(session, repetition.id, place, number)
    return number


@snapshot
def list_branches(session: Session, experiment: str) -> tuple[BranchRead, ...]:
    """Return the closed branches of an experiment, by repetition and number.

    Raises:
        NotFound: the experiment does not exist.
    """
    get_experiment(session, experiment)
    row, repetition, step = BranchRow, RepetitionRow, StepRow
    query = select(row, repetition.number).join(repetition, repetition.id == row.repetition_id)
    found = session.execute(query.where(repetition.experiment_id == experiment).order_by(repetition.number, row.number))

    def view(branch: BranchRow, repetition: int) -> BranchRead:
        of_it = (step.repetition_id == branch.repetition_id) & (step.branch == branch.number)
        steps = tuple(map(_shown, session.scalars(select(step).where(of_it).order_by(step.place))))
        sentences = tuple(step_sentence(each, repetition) for each in steps)
        return BranchRead.filled_from(branch, repetition=repetition, steps=steps, sentences=sentences)

    return tuple(view(branch, number) for branch, number in found)


def _shown(step: StepRow) -> dict[str, Any]:
    """Return a step as the body of its event."""
    fitness = {StepKind.TRANSFERRED: "simulated_fitness", StepKind.MEASURED: "fitness", StepKind.PROBED: "fitness"}
    found = {"kind": step.kind.value, "iteration": step.iteration, **step.body}
    found |= {fitness[step.kind]: step.fitness} if step.kind in fitness else {}
    return found | ({"recorded_fitness": step.recorded} if step.kind is StepKind.PROBED else {})


def _withdraw(session: Session, repetition: int, place: int, branch: int | None) -> None:
    """Withdraw what the closed steps still wait for, and say of the answered requests that they are of the branch."""
    row = RequestRow
    later = (row.repetition_id == repetition) & (row.place >= place) & row.branch.is_(None)
    requests.withdraw(session, later)
    session.execute(update(row).where(later).values(branch=branch))
