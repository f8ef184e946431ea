"""Extension: COMPLETED experiments become as large as if they had been submitted with larger totals.

Each function is one transaction, and raises StoreUnavailable while the database cannot be used.
"""

from collections.abc import Iterator, Sequence

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import ExtensionSpec, State, Verb
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.errors import Conflict, InvalidSpec, Violation
from gaplab.services.experiments.archiving import show_again
from gaplab.services.experiments.lifecycle import get_permitting, get_study_permitting
from gaplab.services.experiments.limits import FREELY, Admission
from gaplab.services.experiments.states import move, settle
from gaplab.services.experiments.submission import admit, extent_of
from gaplab.services.experiments.views import view_experiments, view_studies
from gaplab.services.specs.resolution import is_direct, takes_samples
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import insert_repetitions, repetitions_of
from gaplab.services.store.queries.progress import tallies
from gaplab.services.store.session import Session, transaction


@transaction
def extend_experiment(
    session: Session, experiment_id: str, extension: ExtensionSpec, admitted: Admission = FREELY
) -> ExperimentRead:
    """Queue a COMPLETED experiment again with larger totals; its results so far stay.

    Given its present totals, a stopped experiment is completed.

    Raises:
        NotFound: no such experiment.
        Conflict: it is not COMPLETED, the totals add nothing, or its reality is unknown here.
        InvalidSpec: a total is smaller than the present one or above a limit, or a strategy without samples gets
            iterations.
        CostUnconfirmed: the cost is above the limit, and the request does not confirm it.
        LimitReached: too much work is in progress.
    """
    experiment = get_permitting(session, experiment_id, Verb.EXTEND)
    spec = _spec(experiment)
    if violations := list(_violations(spec, extension)):
        raise InvalidSpec(violations)
    larger = spec.model_copy(update=extension.model_dump(exclude_none=True))
    if not _extend(session, [(experiment, larger)], admitted):
        msg = f"experiment {experiment_id!r} has {larger.iterations} iterations and {larger.repetitions} repetitions "
        raise Conflict(f"{msg}already, and none of these is left to run: ask for larger totals")
    return view_experiments(session, [experiment])[0]


@transaction
def extend_study(session: Session, study_id: str, extension: ExtensionSpec, admitted: Admission = FREELY) -> StudyRead:
    """Queue the COMPLETED experiments of a study again that are smaller than the totals; their results so far stay.

    An experiment that is larger keeps its size, and one that takes no samples has no iterations to add. A stopped
    experiment is completed.

    Raises:
        NotFound: no such study.
        Conflict: none of its experiments is COMPLETED, the totals add nothing to these, or their reality is unknown
            here.
        InvalidSpec: no total is given, or one is above a limit.
        CostUnconfirmed: the cost is above the limit, and the request does not confirm it.
        LimitReached: too much work is in progress.
    """
    study, experiments = get_study_permitting(session, study_id, Verb.EXTEND)
    if violations := list(_missing(extension)):
        raise InvalidSpec(violations)
    if not _extend(session, [(each, _enlarged(_spec(each), extension)) for each in experiments], admitted):
        msg = f"no experiment of study {study_id!r} has anything left to run with these totals: ask for larger totals"
        raise Conflict(msg)
    return view_studies(session, [study])[0]


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


def _violations(spec: ResolvedSpec, extension: ExtensionSpec) -> Iterator[Violation]:
    yield from _missing(extension)
    if extension.iterations is not None and not takes_samples(spec):
        subject = "the direct baseline" if is_direct(spec) else spec.strategy.name
        message = f"{subject} has no iterations: it takes no samples; extend its repetitions"
        yield Violation("/iterations", extension.iterations, message)
    for name, total in extension.model_dump(exclude_none=True).items():
        present = getattr(spec, name)
        if total < present:
            message = f"{total} is less than the {present} {name} that the experiment has; give a total"
            yield Violation(f"/{name}", total, message, f"at least {present}")


def _missing(extension: ExtensionSpec) -> Iterator[Violation]:
    if not extension.model_dump(exclude_none=True):
        yield Violation("", {}, "give a total of iterations, of repetitions, or both", ["iterations", "repetitions"])
