"""Requests that change the state of experiments and studies: pause, resume, stop, cancel, schedule.

`gaplab.schemas.lifecycle` says what each verb means and which states permit it. Each function is one transaction, and
raises StoreUnavailable while the database cannot be used.
"""

from collections.abc import Callable

from sqlalchemy import update

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import PERMITTED, Ending, ScheduleChange, State, Verb
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.services.core.errors import Conflict
from gaplab.services.experiments.archiving import show_again
from gaplab.services.experiments.checks import cancel_unneeded
from gaplab.services.experiments.states import move, settle
from gaplab.services.experiments.views import view_experiments, view_studies
from gaplab.services.store.models import ExperimentRow, RepetitionRow, RequestRow, StudyRow
from gaplab.services.store.queries import attempts, checkpoints
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import experiments_of, get_experiment, get_study, lock, with_failures
from gaplab.services.store.queries.request_states import withdraw
from gaplab.services.store.session import Session, transaction

_EVENTS = {
    Verb.PAUSE: EventKind.PAUSING,
    Verb.RESUME: EventKind.RESUMED,
    Verb.STOP: EventKind.STOPPING,
    Verb.CANCEL: EventKind.CANCELLED,
    Verb.RETRY: EventKind.RETRIED,
}

_PARTICIPLES = {
    Verb.PAUSE: "paused",
    Verb.RESUME: "resumed",
    Verb.STOP: "stopped",
    Verb.CANCEL: "cancelled",
    Verb.EXTEND: "extended",
    Verb.RETRY: "retried",
}


@transaction
def ask_experiment(session: Session, experiment_id: str, verb: Verb) -> ExperimentRead:
    """Pause, resume, stop, cancel or retry an experiment.

    Raises:
        NotFound: no such experiment.
        Conflict: its state does not permit the verb, or none of its repetitions FAILED and could be retried.
    """
    experiment = get_permitting(session, experiment_id, verb)
    if verb is Verb.RETRY and not with_failures(session, [experiment_id]):
        raise Conflict(f"no repetition of experiment {experiment_id!r} has FAILED, so none can be retried")
    _obey(session, experiment, verb)
    return view_experiments(session, [experiment])[0]


@transaction
def ask_study(session: Session, study_id: str, verb: Verb) -> StudyRead:
    """Pause, resume, stop, cancel or retry the experiments of a study that permit it.

    Raises:
        NotFound: no such study.
        Conflict: none of its experiments permits it.
    """
    study, permitting = get_study_permitting(session, study_id, verb)
    if verb is Verb.RETRY:
        failed = with_failures(session, [experiment.id for experiment in permitting])
        permitting = [experiment for experiment in permitting if experiment.id in failed]
        if not permitting:
            raise Conflict(f"no repetition of study {study_id!r} has FAILED, so none can be retried")
    for experiment in permitting:
        _obey(session, experiment, verb)
    return view_studies(session, [study])[0]


@transaction
def schedule_experiment(session: Session, experiment_id: str, change: ScheduleChange) -> ExperimentRead:
    """Change the priority or the number of repetitions that run at once; a missing field stays unchanged.

    Raises:
        NotFound: no such experiment.
    """
    experiment, row = get_experiment(session, experiment_id), ExperimentRow
    lock(session, [experiment.id])
    values = change.model_dump(exclude_unset=True)
    if "priority" in values:
        values["precedence"] = -(values.pop("priority") or 0)
    if values:
        session.execute(update(row).where(row.id == experiment.id).values(values))
    settle(session, [experiment.id])
    session.refresh(experiment)
    return view_experiments(session, [experiment])[0]


def get_permitting(session: Session, experiment_id: str, verb: Verb) -> ExperimentRow:
    """Return the experiment, locked in a state that permits the verb.

    Raises:
        NotFound: no such experiment.
        Conflict: its state does not permit the verb.
    """
    experiment = get_experiment(session, experiment_id)
    lock(session, [experiment.id])
    session.refresh(experiment)
    if experiment.state not in PERMITTED[verb]:
        failed = with_failures(session, [experiment.id])
        able = [
            other.value
            for other in Verb
            if experiment.state in PERMITTED[other] and (other is not Verb.RETRY or failed)
        ]
        msg = (
            f"experiment {experiment_id!r} is {experiment.state} and cannot be {_PARTICIPLES[verb]}; "
            f"permitted: {', '.join(able) or 'nothing'}"
        )
        raise Conflict(msg)
    return experiment


def get_study_permitting(session: Session, study_id: str, verb: Verb) -> tuple[StudyRow, list[ExperimentRow]]:
    """Return the study, and those of its experiments whose state permits the verb; all of its experiments are locked.

    Raises:
        NotFound: no such study.
        Conflict: none of its experiments permits it.
    """
    study, experiments = get_study(session, study_id), experiments_of(session, [study_id])
    lock(session, [experiment.id for experiment in experiments])
    for experiment in experiments:
        session.refresh(experiment)
    permitting = [experiment for experiment in experiments if experiment.state in PERMITTED[verb]]
    if not permitting:
        states = ", ".join(sorted({experiment.state for experiment in experiments}))
        permitted = ", ".join(PERMITTED[verb])
        msg = f"no experiment of study {study_id!r} can be {_PARTICIPLES[verb]}: "
        raise Conflict(msg + f"they are {states}; permitted: {permitted}")
    return study, permitting


def _obey(session: Session, experiment: ExperimentRow, verb: Verb) -> None:
    row = RepetitionRow
    note(session, _EVENTS[verb], experiment.id)
    session.execute(update(ExperimentRow).where(ExperimentRow.id == experiment.id).values(paused_because=None))
    if verb is Verb.CANCEL:
        _end_repetitions(session, experiment.id)
    if verb is Verb.RESUME:
        queued = (row.experiment_id == experiment.id) & (row.state == State.QUEUED)
        session.execute(update(row).where(queued).values(losses=0))
    if verb is Verb.RETRY:
        show_again(session, experiment)
        failed = (row.experiment_id == experiment.id) & (row.state == State.FAILED)
        # Before, a failure left the number of its deleted checkpoints.
        move(session, row, failed, State.QUEUED, losses=0, checkpoints=0, error=None, hidden_error=None)
    settle(session, [experiment.id], _REQUESTED[verb](experiment))
    session.refresh(experiment)
    if verb is Verb.CANCEL:
        cancel_unneeded(session, experiment.sensitivity_id)


def _end_repetitions(session: Session, experiment: str) -> None:
    """Cancel all repetitions that have not ended: queued ones never start, and running ones can no longer write."""
    cancelled = move(session, RepetitionRow, RepetitionRow.experiment_id == experiment, State.CANCELLED)
    attempts.end(session, cancelled, Ending.CANCELLED)
    checkpoints.forget(session, cancelled)
    withdraw(session, RequestRow.repetition_id.in_(cancelled))


_REQUESTED: dict[Verb, Callable[[ExperimentRow], State | None]] = {
    Verb.PAUSE: lambda _: State.PAUSING,
    Verb.RESUME: lambda experiment: State.RUNNING if experiment.running else State.QUEUED,
    Verb.STOP: lambda _: State.STOPPING,
    Verb.CANCEL: lambda _: State.CANCELLED,
    Verb.RETRY: lambda experiment: State.QUEUED if experiment.state.ended else None,
}
