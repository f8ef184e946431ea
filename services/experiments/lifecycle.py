"""Requests that change the state of studies, or of one experiment of them: pause, resume, stop, cancel, schedule.

`gaplab.schemas.lifecycle` says what each verb means and which states permit it. Each function is one transaction, and
raises StoreUnavailable while the database cannot be used.
"""

from collections.abc import Callable

from sqlalchemy import update

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import PERMITTED, Ending, ScheduleChange, State, Verb
from gaplab.schemas.records import StudyRead
from gaplab.services.core.errors import Conflict
from gaplab.services.experiments.archiving import show_again
from gaplab.services.experiments.checks import cancel_unneeded
from gaplab.services.experiments.states import move, settle
from gaplab.services.experiments.views import view
from gaplab.services.store.models import ExperimentRow, RepetitionRow, RequestRow
from gaplab.services.store.queries import attempts, checkpoints
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import Members, lock, members, with_failures
from gaplab.services.store.queries.requests import withdraw
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
def ask(session: Session, id_: str, verb: Verb) -> StudyRead:
    """Pause, resume, stop, cancel or retry the experiments that the id names and that permit it.

    Raises:
        NotFound: no such study or experiment.
        Conflict: none of them permits the verb, or none of their repetitions FAILED and could be retried.
    """
    found, permitting = members_permitting(session, id_, verb)
    if verb is Verb.RETRY:
        failed = with_failures(session, found.ids)
        permitting = [experiment for experiment in permitting if experiment.id in failed]
        if not permitting:
            raise Conflict(f"no repetition of {found} has FAILED, so none can be retried")
    for experiment in permitting:
        _obey(session, experiment, verb)
    return view(session, found)[0]


@transaction
def schedule(session: Session, id_: str, change: ScheduleChange) -> StudyRead:
    """Change the priority or the number of repetitions of each experiment that run at once.

    A missing field stays unchanged.

    Raises:
        NotFound: no such study or experiment.
    """
    found, row = members(session, id_), ExperimentRow
    lock(session, found.ids)
    values = change.model_dump(exclude_unset=True)
    if "priority" in values:
        values["precedence"] = -(values.pop("priority") or 0)
    if values:
        session.execute(update(row).where(row.id.in_(found.ids)).values(values))
    settle(session, found.ids)
    for experiment in found.experiments:
        session.refresh(experiment)
    return view(session, found)[0]


def members_permitting(session: Session, id_: str, verb: Verb) -> tuple[Members, list[ExperimentRow]]:
    """Lock the experiments that the id names, and return all of them, and those whose state permits the verb.

    Raises:
        NotFound: no such study or experiment.
        Conflict: none of them permits it.
    """
    found = members(session, id_)
    lock(session, found.ids)
    for experiment in found.experiments:
        session.refresh(experiment)
    permitting = [each for each in found.experiments if each.state in PERMITTED[verb]]
    if not permitting:
        failed = with_failures(session, found.ids)
        states = sorted({each.state for each in found.experiments})
        able = [
            other.value
            for other in Verb
            if not set(PERMITTED[other]).isdisjoint(states) and (other is not Verb.RETRY or failed)
        ]
        permitted = f"permitted: {', '.join(able) or 'nothing'}"
        raise Conflict(f"{found} is {' and '.join(states)} and cannot be {_PARTICIPLES[verb]}; {permitted}")
    return found, permitting


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
