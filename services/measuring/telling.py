"""Samples that a person tells: of any controller, at any time; each stays in the log until it is forgotten.

What was computed from a sample that changes leaves the log as a closed branch. Nothing is computed here.
"""

from collections.abc import Sequence
from typing import TypeAlias

from gaplab.schemas.corrections import VoidSpec
from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import State
from gaplab.schemas.measurements import AnswerRead, AnswerState, MeasurementSpec
from gaplab.schemas.records import MeasurementKind
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.traces import TracesRead
from gaplab.services.core.arrays import Genome, frozen
from gaplab.services.core.errors import Conflict, InvalidSpec, NotFound
from gaplab.services.core.types import LENGTH, Selected, place_of
from gaplab.services.experiments import lifecycle
from gaplab.services.measuring import corrections
from gaplab.services.measuring.answering import (
    check_attachments,
    check_values,
    insert_answer,
    note_answer,
    says_nothing_new,
    settle_request,
    with_values,
)
from gaplab.services.measuring.doubts import doubts
from gaplab.services.measuring.rewriting import apply, close, go_on, recorded, samples_among
from gaplab.services.measuring.views import view_answer
from gaplab.services.measuring.waiting import record_answer
from gaplab.services.specs.measured import genome_violations
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.lease import Claim, Requested, TimedStep
from gaplab.services.store.models import AnswerRow, ExperimentRow, RepetitionRow, RequestRow
from gaplab.services.store.queries import requests, steps
from gaplab.services.store.queries.experiments import get_experiment, lock, repetitions_of
from gaplab.services.store.queries.logs import last_step
from gaplab.services.store.session import Session, transaction

Told: TypeAlias = tuple[Genome, MeasurementSpec, TracesRead | None]
"""A controller with what was measured, and what its traces say."""

REPLACED = "another sample was told in its place"
AGAIN = "it was told again"


@transaction
def tell(session: Session, experiment_id: str, told: Sequence[Told]) -> tuple[AnswerRead, ...]:
    """Add samples to the log of an experiment's first repetition, all or none, and return their answers.

    The controller that the repetition asks for is answered. One that was measured before gets these values in place of
    those. Any other is a sample of the next iteration, in place of what the repetition asks for. A sample may have any
    number of values. The experiment grows if it has no iteration left.

    Raises:
        NotFound: the experiment does not exist.
        InvalidSpec: a controller or its values do not fit the robot.
        Conflict: the repetition failed or was cancelled.
    """
    experiment, repetition = _locked(session, experiment_id)
    return tuple(view_answer(_tell(session, experiment, repetition, each)) for each in told)


@transaction
def forget(session: Session, experiment_id: str, genome: Genome, spec: VoidSpec) -> None:
    """Take the samples of a controller out of the log of an experiment's first repetition; the others stay.

    Raises:
        NotFound: the experiment does not exist, or no measurement of the controller counts.
    """
    _, repetition = _locked(session, experiment_id)
    counted = _counted(session, repetition, genome)
    if counted is None:
        raise NotFound("no measurement of this controller counts, so there is nothing to forget")
    request = session.get_one(RequestRow, counted.request_id)
    rows = samples_among(recorded(session, request, repetition))
    requests.judge(session, counted, AnswerState.VOID, spec.reason)
    note_answer(session, EventKind.VOIDED, request, repetition, counted, spec.operator)
    if rows:
        of_it = {each.iteration for each in rows}
        first = rows[0].place - 1
        close(session, repetition, first, rows[0].iteration, spec.reason, lambda each: each.iteration not in of_it)
        go_on(session, repetition, closed=True)


def _locked(session: Session, experiment_id: str) -> tuple[ExperimentRow, RepetitionRow]:
    experiment = get_experiment(session, experiment_id)
    lock(session, [experiment.id])
    session.refresh(experiment)
    return experiment, repetitions_of(session, experiment.id)[0]


def _tell(session: Session, experiment: ExperimentRow, repetition: RepetitionRow, told: Told) -> AnswerRow:
    genome, given, traces = told
    spec = with_values(given, traces)
    session.refresh(repetition)
    resolved = spec_of(experiment.spec)
    robot = robot_of(resolved)
    if violations := list(genome_violations(genome.tolist(), robot.label, robot.space)):
        raise InvalidSpec(violations)
    check_values(resolved, spec.values, spec.readings, spec.unit)
    check_attachments(session, spec.attachments)
    if repetition.state in (State.FAILED, State.CANCELLED):
        raise Conflict(f"repetition {repetition.number} is {repetition.state.value}, and takes no samples")
    counted = _counted(session, repetition, genome)
    if counted is not None:
        request = session.get_one(RequestRow, counted.request_id)
        if not says_nothing_new(counted, spec):
            counted = corrections.replace(session, counted, spec, AGAIN, None, traces)
            apply(session, request, repetition, counted, AGAIN, lambda _: True)
        if samples_among(recorded(session, request, repetition)):
            return counted
    asked = next((each for each in requests.pending(session, repetition.id) if each.genome == genome.tolist()), None)
    request = asked or _add(session, experiment, repetition, genome, resolved)
    if counted is None:
        counted = insert_answer(session, request, spec, AnswerState.COUNTED, None, traces)
        counted.doubts = list(() if spec.confirmed else doubts(session, repetition, request, spec.values)) or None
        settle_request(session, request, counted)
    record_answer(session, request, counted)
    return counted


def _counted(session: Session, repetition: RepetitionRow, genome: Genome) -> AnswerRow | None:
    """Return the answer about a controller that counts in a repetition; None without one."""
    same = requests.requests_of(session, repetition.id, requests.of_controller(genome.tolist()))
    return next((found for row in same if (found := requests.counted_answer(session, row))), None)


def _add(
    session: Session, experiment: ExperimentRow, repetition: RepetitionRow, genome: Genome, spec: ResolvedSpec
) -> RequestRow:
    """Let the next iteration of a log begin with a controller, and return the request for its measurement."""
    last = last_step(session, repetition.id)
    place = place_of(last) if isinstance(last, Selected) else repetition.steps
    iteration = (place + LENGTH + 1) // LENGTH
    close(session, repetition, place, iteration, REPLACED)
    if iteration > spec.iterations or repetition.state is State.COMPLETED:
        lifecycle.grow(session, experiment, spec.model_copy(update={"iterations": max(iteration, spec.iterations)}))
    session.refresh(repetition)
    selected = Selected(iteration, frozen(genome), told=True)
    steps.append(session, repetition, TimedStep(selected, 0.0), "")
    claim = Claim(repetition.id, repetition.epoch, experiment.id, repetition.number, spec)
    wanted = Requested(place_of(selected) + 1, iteration, MeasurementKind.SAMPLE, genome)
    return requests.insert(session, claim, wanted)
