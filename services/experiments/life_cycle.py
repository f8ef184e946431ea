"""What people ask of experiments and studies: pause, resume, stop, cancel, extend, another turn.

`gaplab.schemas.lifecycle` says what each means and when it is permitted. Each function is one transaction, and raises
StoreUnavailable while the database cannot be used.
"""

from collections.abc import Iterator

from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.schedule import ExtensionSpec, ScheduleChange
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.experiments.limits import FREELY, Admission, check_extent, check_load
from gaplab.services.experiments.submission import extent_of
from gaplab.services.specs.resolution import is_direct
from gaplab.services.store.queries import reads, verbs
from gaplab.services.store.queries.experiments import Extent
from gaplab.services.store.queries.progress import tallies
from gaplab.services.store.session import Session, Store


def ask_experiment(store: Store, experiment_id: str, verb: Verb) -> ExperimentRead:
    """Pause, resume, stop or cancel an experiment; as it is from now on.

    Raises:
        NotFound: no such experiment.
        Conflict: its state does not permit the verb.
    """
    return store.write(lambda session: reads.read_experiments(session, [verbs.ask(session, experiment_id, verb)])[0])


def ask_study(store: Store, study_id: str, verb: Verb) -> StudyRead:
    """Pause, resume, stop or cancel all experiments of a study that permit it.

    Raises:
        NotFound: no such study.
        Conflict: none of its experiments permits it.
    """
    return store.write(lambda session: reads.read_studies(session, [verbs.ask_study(session, study_id, verb)])[0])


def extend_experiment(
    store: Store, experiment_id: str, extension: ExtensionSpec, admitted: Admission = FREELY
) -> ExperimentRead:
    """Make a COMPLETED experiment as large as one that was submitted with these totals; what is there stands.

    With the totals that it has, one that was stopped is brought to its end.

    Raises:
        NotFound: no such experiment.
        Conflict: it is not COMPLETED, or it is as large already.
        InvalidSpec: less than there is, more than a limit permits, or iterations for the direct baseline.
        LimitReached: there is no room for it now.
    """

    def work(session: Session) -> ExperimentRead:
        def larger(spec: ResolvedSpec) -> tuple[ResolvedSpec, Extent]:
            found = _larger(spec, extension)
            check_extent([found], admitted.limits)
            there = tallies(session, [experiment_id])[experiment_id]
            check_load(session, [found], admitted, done=there.rollouts_done + there.rollouts_saved)
            return found, extent_of(found)

        return reads.read_experiments(session, [verbs.extend(session, experiment_id, larger)])[0]

    return store.write(work)


def schedule_experiment(store: Store, experiment_id: str, change: ScheduleChange) -> ExperimentRead:
    """Give an experiment another priority, or another number of repetitions that run at once; only what is named.

    Raises:
        NotFound: no such experiment.
    """
    changes = change.model_dump(exclude_unset=True)
    return store.write(
        lambda session: reads.read_experiments(session, [verbs.schedule(session, experiment_id, changes)])[0]
    )


def _larger(spec: ResolvedSpec, extension: ExtensionSpec) -> ResolvedSpec:
    if violations := list(_violations(spec, extension)):
        raise InvalidSpec(violations)
    return spec.model_copy(update=extension.model_dump(exclude_none=True))


def _violations(spec: ResolvedSpec, extension: ExtensionSpec) -> Iterator[Violation]:
    wanted = extension.model_dump(exclude_none=True)
    if not wanted:
        yield Violation(
            "", {}, "name the total of iterations, of repetitions, or of both", ["iterations", "repetitions"]
        )
    if extension.iterations is not None and is_direct(spec):
        message = "the direct baseline has no iterations: it evolves in reality itself; extend its repetitions"
        yield Violation("/iterations", extension.iterations, message)
    for name, total in wanted.items():
        there = getattr(spec, name)
        if total < there:
            message = f"it has {there} {name} already, and {total} is a total, not what is added"
            yield Violation(f"/{name}", total, message, f"at least {there}")
