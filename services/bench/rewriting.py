"""Logs with a corrected measurement: its steps are rewritten, what follows is closed, and the repetition goes on."""

from dataclasses import replace

from gaplab.schemas.lifecycle import State
from gaplab.schemas.measurements import RequestState
from gaplab.services.bench import branches
from gaplab.services.bench.consequences import recorded, samples_among
from gaplab.services.core.history import History, recorded_fitness
from gaplab.services.core.stored_specs import spec_of
from gaplab.services.core.types import Probed
from gaplab.services.experiments.archiving import show_again
from gaplab.services.experiments.states import move, settle
from gaplab.services.running.waiting import step_of
from gaplab.services.specs.measured import samples_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.store.models import AnswerRow, ExperimentRow, RepetitionRow, RequestRow
from gaplab.services.store.queries import requests, steps
from gaplab.services.store.queries.experiments import repetitions_of
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.queries.requests import become
from gaplab.services.store.session import Session


def apply(
    session: Session, request: RequestRow, repetition: RepetitionRow, answer: AnswerRow, reason: str
) -> int | None:
    """Write the new values into the steps that the answer is, and close what follows from the first sample."""
    branch = None
    if samples := samples_among(recorded(session, request, repetition)):
        branch = branches.close(session, repetition, samples[0].place + 1, samples[0].iteration, reason)
    experiment = session.get_one(ExperimentRow, repetition.experiment_id)
    for each in recorded(session, request, repetition):
        steps.rewrite(session, repetition.id, step_of(session, experiment, each, answer), answer.operator)
    _rewrite_records(session, repetition)
    _continue(session, repetition, closed=branch is not None)
    return branch


def _rewrite_records(session: Session, repetition: RepetitionRow) -> None:
    """Compute the recorded fitness of every iteration again from its probe and the samples so far."""
    experiment = session.get_one(ExperimentRow, repetition.experiment_id)
    history = History(samples=samples_of(spec_of(experiment.spec)))
    (log,) = logs(session, [repetition.id]).values()
    for step in log:
        if isinstance(step, Probed):
            recorded = recorded_fitness(step.fitness, history.samples)
            steps.rewrite(session, repetition.id, replace(step, recorded=recorded))
        history = history.after(step)


def _continue(session: Session, repetition: RepetitionRow, *, closed: bool) -> None:
    """Queue a repetition that had ended or waits for nothing, if steps were closed; and bring its experiment back."""
    session.refresh(repetition)
    if (repetition.state is State.COMPLETED and closed) or _waits_for_nothing(session, repetition):
        move(session, RepetitionRow, RepetitionRow.id == repetition.id, State.QUEUED, losses=0)
    _settle(session, repetition)


def _waits_for_nothing(session: Session, repetition: RepetitionRow) -> bool:
    """Return whether the request that a repetition waited for was withdrawn, as it followed from a corrected sample."""
    pending = [each for each in requests.requests_of(session, repetition.id) if each.state in requests.PENDING]
    return repetition.state is State.WAITING and not pending


def ask_again(session: Session, request: RequestRow, repetition: RepetitionRow) -> None:
    """Open a request again whose answer is void."""
    session.refresh(repetition)
    spec = spec_of(session.get_one(ExperimentRow, repetition.experiment_id).spec)
    if repetition.state in (State.FAILED, State.CANCELLED):
        become(session, request, RequestState.WITHDRAWN)
    elif request.safety is None and robot_of(spec).world.bodies:  # it was imported; a worker asks with a forecast
        become(session, request, RequestState.WITHDRAWN)
        move(session, RepetitionRow, RepetitionRow.id == repetition.id, State.QUEUED, losses=0)
    else:
        become(session, request, RequestState.OPEN, unanswered=0, branch=None, ended_at=None)
        of_it = RepetitionRow.id == repetition.id
        move(session, RepetitionRow, of_it, State.QUEUED, losses=0)
        move(session, RepetitionRow, of_it, State.WAITING)
    session.flush()
    _settle(session, repetition)


def _settle(session: Session, repetition: RepetitionRow) -> None:
    """Update the state of a repetition's experiment, which a correction may bring back to life."""
    experiment = session.get_one(ExperimentRow, repetition.experiment_id, populate_existing=True)
    alive = any(not each.state.ended for each in repetitions_of(session, experiment.id))
    revived = experiment.state is State.COMPLETED and alive
    if revived:
        show_again(session, experiment)
    settle(session, [experiment.id], State.QUEUED if revived else None)
