"""Submission: a spec is resolved, admitted and stored as a study, in one transaction."""

from collections.abc import Sequence

from gaplab.schemas.records import StudyRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.experiments.checks import queue_for
from gaplab.services.experiments.estimates import check_cost
from gaplab.services.experiments.idempotency import Once, once
from gaplab.services.experiments.limits import FREELY, Admission, check_benches, check_extent, check_load
from gaplab.services.experiments.stored_files import resolved_here
from gaplab.services.experiments.views import view
from gaplab.services.specs.resolution import expected_rollouts, hardware_of, resolve, takes_samples
from gaplab.services.specs.submitted import kept
from gaplab.services.store.queries.experiments import Extent, insert_study, members
from gaplab.services.store.session import Session, Store


def submit(store: Store, spec: ExperimentSpec | StudySpec) -> StudyRead:
    """Store a study with QUEUED repetitions, and queue its sensitivity check unless it exists.

    The spec of an experiment makes a study of one.

    Raises:
        InvalidSpec: the spec is invalid; the error has every violation.
    """
    return submit_once(store, spec, FREELY).answer


def submit_once(store: Store, spec: ExperimentSpec | StudySpec, admitted: Admission) -> Once[StudyRead]:
    """Submit it within limits, and once for each idempotency key.

    Raises:
        InvalidSpec: the spec is invalid; the error has every violation.
        CostUnconfirmed: the cost is above the limit, or a bench nearly known, and the request does not confirm it.
        LimitReached: too much work is in progress.
        KeyReused: the key was used for another request.
        NotFound: the key's study was deleted; the message says when.
    """
    resolved = resolved_here(store, spec, resolve)
    name = spec.name or (resolved[0].name if len(resolved) == 1 else "study")

    sized = [(each, extent_of(each)) for each in resolved]

    def create(session: Session) -> StudyRead:
        check_benches(session, resolved, admitted)
        admit(session, resolved, admitted)
        found = insert_study(session, name, sized, admitted.token, kept(spec, resolved[0]))
        queue_for(session, found.experiments)
        return view(session, found)[0]

    done = once(store, admitted, spec, StudyRead, create)
    if done.replayed:
        with store.reading() as session:
            members(session, done.answer.id)
    return done


def admit(session: Session, specs: Sequence[ResolvedSpec], admitted: Admission, *, done: int = 0) -> None:
    """Refuse work beyond the limits of its sender, in the transaction that stores it; `done` rollouts are completed.

    Raises:
        InvalidSpec: it is too large; the message names the limit.
        CostUnconfirmed: the cost is above the limit, and the request does not confirm it.
        LimitReached: too much work is in progress.
    """
    check_extent(specs, admitted.limits)
    rollouts = sum(expected_rollouts(each) * each.repetitions for each in specs)
    check_cost(session, specs, admitted, rollouts=rollouts, done=done)
    check_load(session, admitted, experiments=len(specs), rollouts=max(0, rollouts - done))


def extent_of(spec: ResolvedSpec) -> Extent:
    """Return the size of one repetition of a resolved spec."""
    samples = spec.iterations if takes_samples(spec) else 0
    return Extent(iterations=samples + 1, rollouts=expected_rollouts(spec), hardware=hardware_of(spec))
