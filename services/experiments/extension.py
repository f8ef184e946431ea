"""Extension: a COMPLETED experiment becomes as large as one that was submitted with larger totals."""

from collections.abc import Iterator

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import State, Verb
from gaplab.schemas.records import ExperimentRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.schedule import ExtensionSpec
from gaplab.services.core.errors import Conflict, InvalidSpec, Violation
from gaplab.services.core.stored_specs import spec_to_run
from gaplab.services.experiments.archiving import show_again
from gaplab.services.experiments.lifecycle import get_permitting
from gaplab.services.experiments.limits import FREELY, Admission, check_extent, check_load
from gaplab.services.experiments.states import move, settle
from gaplab.services.experiments.submission import extent_of
from gaplab.services.experiments.views import view_experiments
from gaplab.services.specs.resolution import is_direct, takes_samples
from gaplab.services.store.models import RepetitionRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import insert_repetitions, repetitions_of
from gaplab.services.store.queries.progress import tallies
from gaplab.services.store.session import Session, transaction


@transaction
def extend_experiment(
    session: Session, experiment_id: str, extension: ExtensionSpec, admitted: Admission = FREELY
) -> ExperimentRead:
    """Queue a COMPLETED experiment again with larger totals; its results so far stay.

    Given its present totals, a stopped experiment is completed. Raises StoreUnavailable while the
    database cannot be used.

    Raises:
        NotFound: no such experiment.
        Conflict: it is not COMPLETED, the totals add nothing, or its reality is unknown here.
        InvalidSpec: a total is smaller than the present one or above a limit, or a strategy without samples gets
            iterations.
        LimitReached: too much work is in progress.
    """
    experiment, row = get_permitting(session, experiment_id, Verb.EXTEND), RepetitionRow
    if None in experiment.spec["reality"]["parameters"].values():
        msg = f"experiment {experiment_id!r} was imported while its reality was hidden, so it cannot be extended"
        raise Conflict(msg)
    spec = _extended(spec_to_run(experiment.spec), extension)
    check_extent([spec], admitted.limits)
    tally = tallies(session, [experiment_id])[experiment_id]
    check_load(session, [spec], admitted, done=tally.rollouts_done + tally.rollouts_saved)
    extent, total = extent_of(spec), spec.repetitions
    present = len(repetitions_of(session, experiment_id))
    extendable = (row.experiment_id == experiment_id) & (row.state != State.FAILED)
    unfinished = extendable & (row.iterations_done < extent.iterations)
    if not move(session, row, unfinished, State.QUEUED, losses=0) and total == present:
        msg = f"experiment {experiment_id!r} has {spec.iterations} iterations and {total} repetitions already"
        raise Conflict(f"{msg}, and none of these is left to run: ask for larger totals")
    insert_repetitions(session, experiment_id, range(present, total))
    experiment.spec = experiment.spec | {"iterations": spec.iterations, "repetitions": total}
    experiment.iterations, experiment.rollouts = extent.iterations, extent.rollouts
    session.flush()
    show_again(session, experiment)
    note(session, EventKind.EXTENDED, experiment_id, iterations=spec.iterations, repetitions=total)
    settle(session, [experiment_id], State.QUEUED)
    session.refresh(experiment)
    return view_experiments(session, [experiment])[0]


def _extended(spec: ResolvedSpec, extension: ExtensionSpec) -> ResolvedSpec:
    if violations := list(_violations(spec, extension)):
        raise InvalidSpec(violations)
    return spec.model_copy(update=extension.model_dump(exclude_none=True))


def _violations(spec: ResolvedSpec, extension: ExtensionSpec) -> Iterator[Violation]:
    totals = extension.model_dump(exclude_none=True)
    if not totals:
        yield Violation("", {}, "give a total of iterations, of repetitions, or both", ["iterations", "repetitions"])
    if extension.iterations is not None and not takes_samples(spec):
        subject = "the direct baseline" if is_direct(spec) else spec.strategy.name
        message = f"{subject} has no iterations: it takes no samples; extend its repetitions"
        yield Violation("/iterations", extension.iterations, message)
    for name, total in totals.items():
        present = getattr(spec, name)
        if total < present:
            message = f"{total} is less than the {present} {name} that the experiment has; give a total"
            yield Violation(f"/{name}", total, message, f"at least {present}")
