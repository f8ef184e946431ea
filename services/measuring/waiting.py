"""Repetitions that wait for a physical measurement, the steps that its answer adds, and refusals of some of them."""

from collections.abc import Mapping

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import Ending, State
from gaplab.schemas.measurements import AnswerState, RequestState
from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.arrays import frozen
from gaplab.services.core.types import History, Measured, Sample, Step, probe_of
from gaplab.services.experiments.lease_ends import Change, end_repetitions, take_back
from gaplab.services.experiments.states import move, settle
from gaplab.services.specs.measured import outcome_of, samples_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.clock import moment
from gaplab.services.store.lease import Claim, Requested, TimedStep
from gaplab.services.store.models import AnswerRow, ExperimentRow, RepetitionRow, RequestRow
from gaplab.services.store.queries import requests, steps
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import new_id
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Session
from gaplab.services.store.statements import storable


def wait(session: Session, asked: Mapping[Claim, Requested]) -> None:
    """End the leases of running repetitions that request a measurement.

    A measurement of the same controller in the same repetition is not asked for twice: its answer is recorded at once.
    So is the failure of a controller that is refused, because it is expected to exceed the limits of the robot.
    """
    requested = {claim: requests.insert(session, claim, wanted) for claim, wanted in asked.items()}
    for claim, request in requested.items():
        waits = Change(State.WAITING, Ending.WAITING, values={"owner": None})
        end_repetitions(session, RepetitionRow.id == claim.id, waits)
        answer = requests.counted_answer(session, request) or refuse(session, claim, request)
        if answer is not None:
            record_answer(session, request, answer)


def record_answer(session: Session, request: RequestRow, answer: AnswerRow) -> None:
    """Add the step of an answer to the log of the waiting repetition, and let it go on, or end it with its last step.

    A repetition that was imported or corrected may be queued or running, on its way to the same request: a worker that
    computes it loses its lease. The experiment must be locked.
    """
    repetition = session.get_one(RepetitionRow, request.repetition_id, populate_existing=True)
    take_back(session, repetition, State.WAITING, Ending.WAITING)
    experiment = session.get_one(ExperimentRow, repetition.experiment_id)
    step = step_of(session, experiment, request, answer)
    steps.append(session, repetition, TimedStep(step, 0.0), answer.operator)
    session.refresh(repetition)
    ended = repetition.iterations_done >= experiment.iterations
    move(session, RepetitionRow, RepetitionRow.id == repetition.id, State.COMPLETED if ended else State.QUEUED)
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


OPERATOR = "gaplab"
"""Operator of an answer that no person and no driver gave."""


def refuse(session: Session, claim: Claim, request: RequestRow) -> AnswerRow | None:
    """Answer a request as failed if its forecast exceeds the limits and the spec says to refuse that; else return None.

    No answer counts for it yet. The controller then counts as tried, but simulators are not tuned on it. A person who
    voids the answer overrules it: the controller is offered, and never refused in this repetition again.
    """
    beyond = (request.safety or {}).get("beyond", ())
    if claim.spec.reality.beyond != "refuse" or not beyond or _overruled(session, request):
        return None
    reason = f"not offered: the simulators expect that {'; '.join(beyond)}"
    refused = AnswerRow(
        id=new_id(),
        repetition_id=request.repetition_id,
        request_id=request.id,
        take=None,
        state=AnswerState.COUNTED,
        values=None,
        failed=storable(reason[:2_000]),
        operator=OPERATOR,
        at=moment(session),
    )
    session.add(refused)
    requests.become(session, request, RequestState.FAILED, ended_at=moment(session))
    body = {"iteration": request.iteration, "request": request.id, "reason": reason}
    note(session, EventKind.REFUSED, claim.experiment_id, claim.number, **body)
    return refused


def _overruled(session: Session, request: RequestRow) -> bool:
    """Return whether a person has voided a refusal of the same controller in the repetition, or answered it."""
    same = requests.requests_of(session, request.repetition_id, requests.of_controller(request.genome))
    answers = requests.answers_of(session, [row.id for row in same]).values()
    return any(answer.state is not AnswerState.COUNTED for given in answers for answer in given)
