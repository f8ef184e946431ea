"""Extension: COMPLETED experiments become as large as if they had been submitted with larger totals.

An experiment that is larger keeps its size, and one that takes no samples has no iterations to add. Given its present
totals, a stopped experiment is completed.
"""

from collections.abc import Iterator, Sequence

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import ExtensionSpec, State, Verb
from gaplab.schemas.records import StudyRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.errors import Conflict, InvalidSpec, Violation
from gaplab.services.experiments.archiving import show_again
from gaplab.services.experiments.lifecycle import members_permitting
from gaplab.services.experiments.limits import FREELY, Admission
from gaplab.services.experiments.states import move, settle
from gaplab.services.experiments.submission import admit, extent_of
from gaplab.services.experiments.views import view
from gaplab.services.specs.resolution import is_direct, takes_samples
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import insert_repetitions, repetitions_of
from gaplab.services.store.queries.progress import tallies
from gaplab.services.store.session import Session, transaction


@transaction
def extend(session: Session, id_: str, extension: ExtensionSpec, admitted: Admission = FREELY) -> StudyRead:
    """Queue again, with larger totals, the COMPLETED experiments that the id names; their results so far stay.

    Raises:
        NotFound: no such study or experiment.
        Conflict: none of them is COMPLETED, the totals add nothing to these, or their reality is unknown here.
        InvalidSpec: no total is given, one is smaller than that of each experiment or above a limit, or strategies
            without samples get iterations.
        CostUnconfirmed: the cost is above the limit, and the request does not confirm it.
        LimitReached: too much work is in progress.
        StoreUnavailable: the database cannot be used now.
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
        _grow(session, experiment, spec)
    return True


def _has_work(session: Session, experiment: ExperimentRow, spec: ResolvedSpec) -> bool:
    repetitions, iterations = repetitions_of(session, experiment.id), extent_of(spec).iterations
    unfinished = (row.state != State.FAILED and row.iterations_done < iterations for row in repetitions)
    return spec.repetitions > len(repetitions) or any(unfinished)


def _grow(session: Session, experiment: ExperimentRow, spec: ResolvedSpec) -> None:
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
