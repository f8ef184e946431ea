"""What people ask of experiments: pause, resume, stop, cancel, extend, and another turn."""

from collections.abc import Callable
from typing import Any

from sqlalchemy import update
from sqlalchemy.orm import Session

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import OPEN, PERMITTED, Ending, State, Verb
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.errors import Conflict
from gaplab.services.store.clock import now
from gaplab.services.store.models import ExperimentRow, RepetitionRow, StudyRow
from gaplab.services.store.queries import attempts, checkpoints
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import (
    Extent,
    experiments_of,
    get_experiment,
    get_study,
    insert_repetitions,
    lock,
    repetitions_of,
)
from gaplab.services.store.queries.settling import settle

_TOLD = {
    Verb.PAUSE: EventKind.PAUSING,
    Verb.RESUME: EventKind.RESUMED,
    Verb.STOP: EventKind.STOPPING,
    Verb.CANCEL: EventKind.CANCELLED,
}

_DONE = {
    Verb.PAUSE: "paused",
    Verb.RESUME: "resumed",
    Verb.STOP: "stopped",
    Verb.CANCEL: "cancelled",
    Verb.EXTEND: "extended",
}


def ask(session: Session, experiment_id: str, verb: Verb) -> ExperimentRow:
    """The experiment after the verb.

    Raises:
        NotFound: no such experiment.
        Conflict: its state does not permit the verb.
    """
    experiment = _locked(session, experiment_id, verb)
    _obey(session, experiment, verb)
    return experiment


def ask_study(session: Session, study_id: str, verb: Verb) -> StudyRow:
    """The study after the verb, which goes to each of its experiments that permits it.

    Raises:
        NotFound: no such study.
        Conflict: none of them does.
    """
    study, rows = get_study(session, study_id), experiments_of(session, [study_id])
    lock(session, [row.id for row in rows])
    for row in rows:
        session.refresh(row)
    able = [row for row in rows if row.state in PERMITTED[verb]]
    if not able:
        states = ", ".join(sorted({row.state for row in rows}))
        wanted = ", ".join(PERMITTED[verb])
        msg = f"no experiment of study {study_id!r} can be {_DONE[verb]}: they are {states}; permitted is {wanted}"
        raise Conflict(msg)
    for row in able:
        _obey(session, row, verb)
    return study


def extend(
    session: Session, experiment_id: str, larger: Callable[[ResolvedSpec], tuple[ResolvedSpec, Extent]]
) -> ExperimentRow:
    """The COMPLETED experiment QUEUED again with a larger spec; what is there stands.

    Args:
        session: of a transaction that writes.
        experiment_id: of the experiment.
        larger: its spec -> one with more iterations or repetitions, and the extent of a repetition then.

    Raises:
        NotFound: no such experiment.
        Conflict: it is not COMPLETED, nothing would be left to run, or its reality is not known here.
    """
    experiment, row = _locked(session, experiment_id, Verb.EXTEND), RepetitionRow
    if None in experiment.spec["reality"]["parameters"].values():
        msg = f"experiment {experiment_id!r} was imported before its reality was shown: nobody can go on with it"
        raise Conflict(msg)
    spec, extent = larger(ResolvedSpec.model_validate(experiment.spec))
    there, total = len(repetitions_of(session, experiment.id)), spec.repetitions
    again = session.scalars(
        update(row)
        .where(
            row.experiment_id == experiment.id,
            row.state.in_((State.COMPLETED, State.CANCELLED)),
            row.iterations_done < extent.iterations,
        )
        .values(state=State.QUEUED, ended_at=None, losses=0)
        .returning(row.id)
    ).all()
    if not again and total == there:
        msg = f"experiment {experiment_id!r} has {spec.iterations} iterations and {total} repetitions already"
        raise Conflict(f"{msg}, and none of them is left to run; larger totals extend it")
    insert_repetitions(session, experiment.id, range(there, total))
    stored = experiment.spec | {"iterations": spec.iterations, "repetitions": total}
    values = {"spec": stored, "iterations": extent.iterations, "rollouts": extent.rollouts}
    note(session, EventKind.EXTENDED, experiment.id, iterations=spec.iterations, repetitions=total)
    _move(session, experiment, state=State.QUEUED, ended_at=None, **values)
    session.refresh(experiment)
    return experiment


def schedule(session: Session, experiment_id: str, changes: dict[str, int | None]) -> ExperimentRow:
    """The experiment with another priority or limit of repetitions at once.

    Raises:
        NotFound: no such experiment.
    """
    experiment = get_experiment(session, experiment_id)
    lock(session, [experiment.id])
    values = {"precedence" if name == "priority" else name: value for name, value in changes.items()}
    if "precedence" in values:
        values["precedence"] = -(values["precedence"] or 0)
    _move(session, experiment, **values)
    session.refresh(experiment)
    return experiment


def _locked(session: Session, experiment_id: str, verb: Verb) -> ExperimentRow:
    """The experiment, locked in a state that permits the verb.

    Raises:
        NotFound: no such experiment.
        Conflict: its state does not permit the verb.
    """
    experiment = get_experiment(session, experiment_id)
    lock(session, [experiment.id])
    session.refresh(experiment)
    if experiment.state not in PERMITTED[verb]:
        able = [each.value for each in Verb if experiment.state in PERMITTED[each]]
        msg = (
            f"experiment {experiment_id!r} is {experiment.state} and cannot be {_DONE[verb]}; "
            f"what can be done with it: {', '.join(able) or 'nothing'}"
        )
        raise Conflict(msg)
    return experiment


def _obey(session: Session, experiment: ExperimentRow, verb: Verb) -> None:
    note(session, _TOLD[verb], experiment.id)
    _OBEY[verb](session, experiment)
    session.refresh(experiment)


def _pause(session: Session, experiment: ExperimentRow) -> None:
    _move(session, experiment, state=State.PAUSING)


def _resume(session: Session, experiment: ExperimentRow) -> None:
    _move(session, experiment, state=State.RUNNING if experiment.running else State.QUEUED)


def _stop(session: Session, experiment: ExperimentRow) -> None:
    _move(session, experiment, state=State.STOPPING)


def _cancel(session: Session, experiment: ExperimentRow) -> None:
    """Its queued repetitions never start, and its running ones cannot write any more."""
    row = RepetitionRow
    called_off = (
        update(row)
        .where(row.experiment_id == experiment.id, row.state.in_(OPEN))
        .values(state=State.CANCELLED, ended_at=now())
        .returning(row.id)
    )
    repetitions = session.scalars(called_off).all()
    attempts.end(session, repetitions, Ending.CANCELLED)
    checkpoints.forget(session, repetitions)
    _move(session, experiment, state=State.CANCELLED, ended_at=now())


_OBEY: dict[Verb, Callable[[Session, ExperimentRow], None]] = {
    Verb.PAUSE: _pause,
    Verb.RESUME: _resume,
    Verb.STOP: _stop,
    Verb.CANCEL: _cancel,
}


def _move(session: Session, experiment: ExperimentRow, **values: Any) -> None:  # noqa: ANN401 - columns have many types
    if values:
        session.execute(update(ExperimentRow).where(ExperimentRow.id == experiment.id).values(values))
    settle(session, [experiment.id])
