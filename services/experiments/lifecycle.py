"""Requests that change the state of studies, or of one experiment of them, their schedule, or their size.

`gaplab.schemas.lifecycle` says what each verb means and which states permit it. Use cases raise NotFound if nothing has
the id.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from sqlalchemy import update

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import PERMITTED, Ending, ExtensionSpec, ScheduleChange, State, Verb
from gaplab.schemas.records import StudyRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.errors import Conflict, InvalidSpec, Violation
from gaplab.services.experiments.checks import cancel_unneeded
from gaplab.services.experiments.editing import show_again
from gaplab.services.experiments.limits import FREELY, Admission
from gaplab.services.experiments.states import move, settle
from gaplab.services.experiments.submission import admit, extent_of
from gaplab.services.experiments.views import view
from gaplab.services.specs.resolution import is_direct, takes_samples
from gaplab.services.store.models import ExperimentRow, RepetitionRow, RequestRow
from gaplab.services.store.queries import attempts, checkpoints
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import (
    Members,
    insert_repetitions,
    lock,
    members,
    repetitions_of,
    with_failures,
)
from gaplab.services.store.queries.progress import tallies
from gaplab.services.store.queries.requests import withdraw
from gaplab.services.store.session import Session, transaction


class _Meaning(NamedTuple):
    """What a verb does: its participle, its event, and the state that it requests; None if that follows."""

    participle: str
    event: EventKind
    requested: Callable[[ExperimentRow], State | None]


_MEANINGS = {
    Verb.PAUSE: _Meaning("paused", EventKind.PAUSING, lambda _: State.PAUSING),
    Verb.RESUME: _Meaning("resumed", EventKind.RESUMED, lambda row: State.RUNNING if row.running else State.QUEUED),
    Verb.STOP: _Meaning("stopped", EventKind.STOPPING, lambda _: State.STOPPING),
    Verb.CANCEL: _Meaning("cancelled", EventKind.CANCELLED, lambda _: State.CANCELLED),
    Verb.EXTEND: _Meaning("extended", EventKind.EXTENDED, lambda _: State.QUEUED),
    Verb.RETRY: _Meaning("retried", EventKind.RETRIED, lambda row: State.QUEUED if row.state.ended else None),
}


@transaction
def ask(session: Session, id_: str, verb: Verb) -> StudyRead:
    """Pause, resume, stop, cancel or retry the experiments that the id names and that permit it.

    Raises:
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
        raise Conflict(f"{found} is {' and '.join(states)} and cannot be {_MEANINGS[verb].participle}; {permitted}")
    return found, permitting


def _obey(session: Session, experiment: ExperimentRow, verb: Verb) -> None:
    row = RepetitionRow
    note(session, _MEANINGS[verb].event, experiment.id)
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
    settle(session, [experiment.id], _MEANINGS[verb].requested(experiment))
    session.refresh(experiment)
    if verb is Verb.CANCEL:
        cancel_unneeded(session, experiment.sensitivity_id)


def _end_repetitions(session: Session, experiment: str) -> None:
    """Cancel all repetitions that have not ended: queued ones never start, and running ones can no longer write."""
    cancelled = move(session, RepetitionRow, RepetitionRow.experiment_id == experiment, State.CANCELLED)
    attempts.end(session, cancelled, Ending.CANCELLED)
    checkpoints.forget(session, cancelled)
    withdraw(session, RequestRow.repetition_id.in_(cancelled))


@transaction
def extend(session: Session, id_: str, extension: ExtensionSpec, admitted: Admission = FREELY) -> StudyRead:
    """Queue again, with larger totals, the COMPLETED experiments that the id names; their results so far stay.

    Raises:
        Conflict: none of them is COMPLETED, the totals add nothing to these, or their reality is unknown here.
        InvalidSpec: no total is given, one is smaller than that of each experiment or above a limit, or strategies
            without samples get iterations.
        CostUnconfirmed: the cost is above the limit, and the request does not confirm it.
        LimitReached: too much work is in progress.
    """
    found, completed = members_permitting(session, id_, Verb.EXTEND)
    specs = [_spec(each) for each in completed]
    if violations := list(_violations(specs, extension)):
        raise InvalidSpec(violations)
    larger = [(each, _enlarged(spec, extension)) for each, spec in zip(completed, specs, strict=True)]
    if not _extend(session, larger, admitted):
        most = {name: max(getattr(spec, name) for _, spec in larger) for name in ("iterations", "repetitions")}
        msg = f"{found} has {most['iterations']} iterations and {most['repetitions']} repetitions already, and none of "
        raise Conflict(f"{msg}these is left to run: ask for larger totals")
    return view(session, found)[0]


def _spec(experiment: ExperimentRow) -> ResolvedSpec:
    if None in experiment.spec["reality"]["parameters"].values():
        msg = f"experiment {experiment.id!r} was imported while its reality was hidden, so it cannot be extended"
        raise Conflict(msg)
    return ResolvedSpec.model_validate(experiment.spec)


def _enlarged(spec: ResolvedSpec, extension: ExtensionSpec) -> ResolvedSpec:
    totals = extension.model_dump(exclude_none=True, exclude=None if takes_samples(spec) else {"iterations"})
    return spec.model_copy(update={name: max(total, getattr(spec, name)) for name, total in totals.items()})


def _extend(session: Session, larger: Sequence[tuple[ExperimentRow, ResolvedSpec]], admitted: Admission) -> bool:
    """Give experiments the sizes of their larger specs; return whether any of them has something left to run."""
    growing = [(experiment, spec) for experiment, spec in larger if _has_work(session, experiment, spec)]
    if not growing:
        return False
    specs = [spec for _, spec in growing]
    computed = tallies(session, [experiment.id for experiment, _ in growing]).values()
    done = sum(tally.rollouts_done + tally.rollouts_saved for tally in computed)
    admit(session, specs, admitted, done=done)
    for experiment, spec in growing:
        grow(session, experiment, spec)
    return True


def _has_work(session: Session, experiment: ExperimentRow, spec: ResolvedSpec) -> bool:
    repetitions, iterations = repetitions_of(session, experiment.id), extent_of(spec).iterations
    unfinished = (row.state != State.FAILED and row.iterations_done < iterations for row in repetitions)
    return spec.repetitions > len(repetitions) or any(unfinished)


def grow(session: Session, experiment: ExperimentRow, spec: ResolvedSpec) -> None:
    """Give a locked experiment the size of a larger spec, and queue again what has ended and is unfinished then."""
    extent, present, row = extent_of(spec), len(repetitions_of(session, experiment.id)), RepetitionRow
    waits_for_retry = row.state == State.FAILED
    unfinished = (row.experiment_id == experiment.id) & ~waits_for_retry & (row.iterations_done < extent.iterations)
    move(session, row, unfinished, State.QUEUED, losses=0)
    insert_repetitions(session, experiment.id, range(present, spec.repetitions))
    experiment.spec = experiment.spec | {"iterations": spec.iterations, "repetitions": spec.repetitions}
    experiment.iterations, experiment.rollouts = extent.iterations, extent.rollouts
    session.flush()
    show_again(session, experiment)
    note(session, EventKind.EXTENDED, experiment.id, iterations=spec.iterations, repetitions=spec.repetitions)
    settle(session, [experiment.id], State.QUEUED)
    session.refresh(experiment)


def _violations(specs: Sequence[ResolvedSpec], extension: ExtensionSpec) -> Iterator[Violation]:
    totals = extension.model_dump(exclude_none=True)
    if not totals:
        yield Violation("", {}, "give a total of iterations, of repetitions, or both", ["iterations", "repetitions"])
    for name, total in totals.items():
        able = [spec for spec in specs if name != "iterations" or takes_samples(spec)]
        if not able:
            subject = "the direct baseline" if is_direct(specs[0]) else specs[0].strategy.name
            message = f"{subject} has no iterations: it takes no samples; extend its repetitions"
            yield Violation("/iterations", total, message)
        elif total < (present := min(getattr(spec, name) for spec in able)):
            message = f"{total} is less than the {present} {name} that there are; give a total"
            yield Violation(f"/{name}", total, message, f"at least {present}")
