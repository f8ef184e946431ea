"""Repetitions that wait for a physical measurement, and the steps that its answer adds to their logs."""

from collections.abc import Mapping

from sqlalchemy.orm import Session

from gaplab.schemas.lifecycle import Ending, State
from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.arrays import frozen
from gaplab.services.core.history import History
from gaplab.services.core.probes import probe_of
from gaplab.services.core.stored_specs import spec_of
from gaplab.services.core.types import Measured, Sample, Step
from gaplab.services.experiments.states import move, settle
from gaplab.services.running.leases import Change
from gaplab.services.running.refusals import refuse
from gaplab.services.running.repetition_leases import RepetitionLeases
from gaplab.services.specs.measured import outcome_of, samples_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.store.lease import Claim, Requested, TimedStep
from gaplab.services.store.models import AnswerRow, ExperimentRow, RepetitionRow, RequestRow
from gaplab.services.store.queries import requests, steps
from gaplab.services.store.queries.logs import logs

_LEASES = RepetitionLeases()


def wait(session: Session, asked: Mapping[Claim, Requested]) -> frozenset[Claim]:
    """End the leases of repetitions that request a measurement, and return them.

    A measurement of the same controller in the same repetition is not asked for twice: its answer is recorded at once.
    So is the failure of a controller that is refused, because it is expected to exceed the limits of the robot.
    """
    for claim, request in requests.insert(session, asked).items():
        _LEASES.end(session, _LEASES.of([claim]), Change(State.WAITING, Ending.WAITING, values={"owner": None}))
        answer = requests.counted_answer(session, request) or refuse(session, claim, request)
        if answer is not None:
            record_answer(session, request, answer)
    return frozenset(asked)


def record_answer(session: Session, request: RequestRow, answer: AnswerRow) -> None:
    """Add the step of an answer to the log of the waiting repetition, and let it go on, or end it with its last step.

    A repetition that was imported or corrected may be queued or running, on its way to the same request: a worker that
    computes it loses its lease. The experiment must be locked.
    """
    of_it = RepetitionRow.id == request.repetition_id
    _LEASES.end(session, of_it, Change(State.WAITING, Ending.WAITING, values={"owner": None}))
    repetition = session.get_one(RepetitionRow, request.repetition_id, populate_existing=True)
    experiment = session.get_one(ExperimentRow, repetition.experiment_id)
    step = step_of(session, experiment, request, answer)
    steps.append(session, repetition, TimedStep(step, 0.0), answer.operator)
    session.refresh(repetition)
    ended = repetition.iterations_done >= experiment.iterations
    move(session, RepetitionRow, of_it, State.COMPLETED if ended else State.QUEUED)
    settle(session, [experiment.id])


def step_of(session: Session, experiment: ExperimentRow, request: RequestRow, answer: AnswerRow) -> Step:
    """Return the step that an answer is, after the log of its repetition."""
    spec = spec_of(experiment.spec)
    outcome, repeats = outcome_of(robot_of(spec).sensors, answer.values, answer.readings)
    if request.kind is MeasurementKind.SAMPLE:
        return Measured(request.iteration, Sample(frozen(request.genome), *outcome, repeats))
    history = History(samples=samples_of(spec))
    for step in logs(session, [request.repetition_id])[request.repetition_id]:
        if step.iteration <= request.iteration:
            history = history.after(step)
    return probe_of(history, request.iteration, *outcome, repeats)
