"""What a correction does to a log: what follows from a measurement, closed branches, and steps that are rewritten.

The steps after a corrected sample leave the log as a closed branch, and stay readable; the repetition goes on.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from operator import attrgetter
from typing import Any, Literal, TypeAlias

from sqlalchemy import func, insert, select, update

from gaplab.schemas.corrections import BranchRead, Consequences
from gaplab.schemas.lifecycle import Ending, State
from gaplab.schemas.measurements import RequestState
from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.types import (
    LENGTH,
    History,
    Measured,
    Probed,
    Selected,
    Step,
    place_of,
    recorded_fitness,
)
from gaplab.services.experiments.editing import show_again
from gaplab.services.experiments.lease_ends import take_back
from gaplab.services.experiments.states import move, settle
from gaplab.services.findings.event_sentences import step_sentence
from gaplab.services.measuring.waiting import step_of
from gaplab.services.specs.measured import samples_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.models import (
    AnswerRow,
    BranchRow,
    ExperimentRow,
    RepetitionRow,
    RequestRow,
    StepKind,
    StepRow,
)
from gaplab.services.store.queries import checkpoints, requests, steps
from gaplab.services.store.queries.experiments import get_experiment, repetitions_of
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.queries.requests import become
from gaplab.services.store.session import Session, snapshot


def recorded(session: Session, request: RequestRow, repetition: RepetitionRow) -> tuple[RequestRow, ...]:
    """Return the requests whose steps in the log are the answer to a request, by place.

    One measurement answers all requests of a repetition for the same controller.
    """
    row = RequestRow
    recorded = row.place < select(RepetitionRow.steps).where(RepetitionRow.id == repetition.id).scalar_subquery()
    same = func.coalesce(row.same_as, row.id) == request.id
    return tuple(requests.requests_of(session, repetition.id, same, row.branch.is_(None), recorded))


def samples_among(rows: Sequence[RequestRow]) -> list[RequestRow]:
    """Return the requests for samples, from which the later steps of the log follow; none follows from a probe."""
    return [each for each in rows if each.kind is MeasurementKind.SAMPLE]


def consequences(
    session: Session, request: RequestRow, repetition: RepetitionRow, verb: Literal["correct", "void"]
) -> Consequences:
    """Return what a correction or a void would do."""
    rows = recorded(session, request, repetition)
    if not rows:
        return nothing_follows(request, repetition, "it belongs to a closed branch, so no step follows from it")
    (log,) = logs(session, [repetition.id]).values()
    leading = rows if verb == "void" else samples_among(rows)
    later = _closing(log, leading[0].place + 1, NONE if verb == "void" else was_told)[0] if leading else ()
    measured = [step for step in later if isinstance(step, Measured | Probed)]
    measurements = sum(not (isinstance(step, Probed) and step.left_out) for step in measured)
    words = "nothing follows from it"
    if later:
        again = f"; {measurements} of them measurements, which are reused if asked for again" if measurements else ""
        words = f"{len(later)} stored step{'' if len(later) == 1 else 's'} after it will be computed again{again}"
        iterations = session.get_one(ExperimentRow, repetition.experiment_id).iterations
        if repetition.state is State.COMPLETED and repetition.iterations_done < iterations:
            words += "; the repetition, which was stopped, goes on to its last iteration"
    words += "" if verb == "correct" else "; the controller is requested again"
    follows = {"iteration": rows[0].iteration, "steps": len(later), "measurements": measurements}
    return nothing_follows(request, repetition, words).model_copy(update=follows)


def nothing_follows(request: RequestRow, repetition: RepetitionRow, words: str) -> Consequences:
    """Return consequences without a step, with these words."""
    return Consequences(
        request=request.id,
        repetition=repetition.number,
        iteration=request.iteration,
        steps=0,
        measurements=0,
        words=words,
    )


Stays: TypeAlias = Callable[[Selected], bool]
"""Whether a sample stays in the log when a step before it changes, by how it was selected."""

NONE: Stays = lambda _: False  # noqa: E731 - a value, like the others

was_told: Stays = attrgetter("told")
"""What a person chose to measure does not follow from the steps before it."""


def _closing(log: Sequence[Step], place: int, stays: Stays) -> tuple[list[Step], list[int]]:
    """Return the steps from a place on that are to be closed, and the iterations of the samples that stay."""
    later = [step for step in log if place_of(step) >= place]
    samples = (first for first, second in pairwise(later) if isinstance(second, Measured))
    kept = [each.iteration for each in samples if isinstance(each, Selected) and stays(each)]
    gone = (step for step in later if step.iteration not in kept or not isinstance(step, Selected | Measured))
    return list(gone), kept


def close(
    session: Session, repetition: RepetitionRow, place: int, iteration: int, reason: str, stays: Stays = NONE
) -> int | None:
    """Close the steps of a log from a place on, and return the number of their branch; None if no step is closed.

    A worker that computes further steps loses its lease. The caller has locked the experiment, and settles it.
    `iteration` is that of the measurement that was corrected. Samples that stay are the next ones of the log.
    """
    take_back(session, repetition, State.QUEUED, Ending.HANDED_BACK, "a measurement was corrected")
    checkpoints.forget(session, [repetition.id])
    number = None
    session.refresh(repetition)
    log = logs(session, [repetition.id])[repetition.id] if repetition.steps > place else ()
    gone, kept = _closing(log, place, stays)
    if gone:
        of_it = select(func.max(BranchRow.number)).where(BranchRow.repetition_id == repetition.id)
        number = 1 + (session.scalar(of_it) or 0)
        values = {"repetition_id": repetition.id, "number": number, "iteration": iteration, "reason": reason}
        session.execute(insert(BranchRow).values(**values))
        steps.close(session, repetition.id, place, number, kept)
        session.refresh(repetition)
    _withdraw(session, repetition.id, place, number, kept if gone else ())
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


def _withdraw(session: Session, repetition: int, place: int, branch: int | None, kept: Sequence[int]) -> None:
    """Withdraw what the closed steps still wait for, and assign the answered requests to the branch."""
    row = RequestRow
    later = (row.repetition_id == repetition) & (row.place >= place) & row.branch.is_(None)
    requests.withdraw(session, later)
    sample = (row.kind == MeasurementKind.SAMPLE) & row.iteration.in_(kept)
    session.execute(update(row).where(later, ~sample).values(branch=branch))
    for old, new in steps.renumbered(place, kept):
        moved = {"iteration": new, "place": row.place + (new - old) * LENGTH}
        session.execute(update(row).where(later, sample, row.iteration == old).values(moved))


def apply(
    session: Session,
    request: RequestRow,
    repetition: RepetitionRow,
    answer: AnswerRow,
    reason: str,
    stays: Stays = was_told,
) -> int | None:
    """Write the new values into the steps that the answer is, and close what follows from the first sample."""
    branch = None
    if samples := samples_among(recorded(session, request, repetition)):
        branch = close(session, repetition, samples[0].place + 1, samples[0].iteration, reason, stays)
    experiment = session.get_one(ExperimentRow, repetition.experiment_id)
    for each in recorded(session, request, repetition):
        steps.rewrite(session, repetition.id, step_of(session, experiment, each, answer), answer.operator)
    _rewrite_records(session, repetition)
    go_on(session, repetition, closed=branch is not None)
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


def go_on(session: Session, repetition: RepetitionRow, *, closed: bool) -> None:
    """Queue a repetition that had ended or waits for nothing, if steps were closed; and bring its experiment back.

    It waits for nothing if its request was withdrawn, as it followed from a corrected sample.
    """
    session.refresh(repetition)
    waits_for_nothing = repetition.state is State.WAITING and not requests.pending(session, repetition.id)
    if (repetition.state is State.COMPLETED and closed) or waits_for_nothing:
        move(session, RepetitionRow, RepetitionRow.id == repetition.id, State.QUEUED, losses=0)
    _settle(session, repetition)


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
        move(session, RepetitionRow, RepetitionRow.id == repetition.id, State.WAITING, losses=0)
    session.flush()
    _settle(session, repetition)


def _settle(session: Session, repetition: RepetitionRow) -> None:
    """Update the state of a repetition's experiment, which a correction may resume."""
    experiment = session.get_one(ExperimentRow, repetition.experiment_id, populate_existing=True)
    alive = any(not each.state.ended for each in repetitions_of(session, experiment.id))
    revived = experiment.state is State.COMPLETED and alive
    if revived:
        show_again(session, experiment)
    settle(session, [experiment.id], State.QUEUED if revived else None)
