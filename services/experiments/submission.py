"""Submission of experiments and studies: they are resolved, admitted and stored in one transaction.

All functions raise StoreUnavailable while the database cannot be used.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.experiments.bench_names import check_benches
from gaplab.services.experiments.checks import queue_for
from gaplab.services.experiments.estimates import check_cost
from gaplab.services.experiments.idempotency import Once, once
from gaplab.services.experiments.limits import FREELY, Admission, check_extent, check_load
from gaplab.services.experiments.stored_robots import resolved_here
from gaplab.services.experiments.views import view_experiments, view_studies
from gaplab.services.specs.resolution import resolve_experiment, resolve_study, takes_samples
from gaplab.services.specs.rollouts import expected_rollouts, hardware_of
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries.experiments import Extent, get_experiment, get_study, insert_experiment, insert_study
from gaplab.services.store.session import Session, Store

R = TypeVar("R", ExperimentRead, StudyRead)


def submit_experiment(store: Store, spec: ExperimentSpec) -> ExperimentRead:
    """Store the resolved experiment with QUEUED repetitions, and queue its sensitivity check unless it exists.

    Raises:
        InvalidSpec: the spec is invalid; the error has every violation.
    """
    return admit_experiment(store, spec, FREELY).answer


def admit_experiment(store: Store, spec: ExperimentSpec, admitted: Admission) -> Once[ExperimentRead]:
    """Submit it within limits, and once for each idempotency key.

    Raises:
        InvalidSpec: the spec is invalid; the error has every violation.
        CostUnconfirmed: the cost is above the limit, or a bench nearly known, and the request does not confirm it.
        LimitReached: too much work is in progress.
        KeyReused: the key was used for another request.
        NotFound: the key's experiment was deleted.
    """
    resolved = resolved_here(store, spec, resolve_experiment)

    def create(session: Session) -> ExperimentRead:
        check_benches(session, [resolved], admitted)
        admit(session, [resolved], admitted)
        row = _insert(session, resolved, admitted)
        queue_for(session, [row])
        return view_experiments(session, [row])[0]

    return _unless_deleted(store, once(store, admitted, spec, ExperimentRead, create), get_experiment)


def submit_study(store: Store, spec: StudySpec) -> StudyRead:
    """Store the study with an experiment for each strategy, and queue its sensitivity check unless it exists.

    Raises:
        InvalidSpec: the spec is invalid; the error has every violation.
    """
    return admit_study(store, spec, FREELY).answer


def admit_study(store: Store, spec: StudySpec, admitted: Admission) -> Once[StudyRead]:
    """Submit it within limits, and once for each idempotency key.

    Raises:
        InvalidSpec: the spec is invalid; the error has every violation.
        CostUnconfirmed: the cost is above the limit, or a bench nearly known, and the request does not confirm it.
        LimitReached: too much work is in progress.
        KeyReused: the key was used for another request.
        NotFound: the key's study was deleted.
    """
    resolved = resolved_here(store, spec, resolve_study)

    def create(session: Session) -> StudyRead:
        check_benches(session, resolved, admitted)
        admit(session, resolved, admitted)
        study = insert_study(session, spec.name or "study")
        rows = [_insert(session, each, admitted, study, position) for position, each in enumerate(resolved)]
        queue_for(session, rows)
        return view_studies(session, [study])[0]

    return _unless_deleted(store, once(store, admitted, spec, StudyRead, create), get_study)


def admit(session: Session, specs: Sequence[ResolvedSpec], admitted: Admission, *, done: int = 0) -> None:
    """Refuse work beyond the limits of its sender, in the transaction that stores it; `done` rollouts are completed.

    Raises:
        InvalidSpec: it is too large; the message names the limit.
        CostUnconfirmed: the cost is above the limit, and the request does not confirm it.
        LimitReached: too much work is in progress.
    """
    check_extent(specs, admitted.limits)
    check_cost(session, specs, admitted, done=done)
    check_load(session, specs, admitted, done=done)


def _unless_deleted(store: Store, done: Once[R], get: Callable[[Session, str], object]) -> Once[R]:
    """Return the answer, unless it is a stored one of what was deleted since.

    Raises:
        NotFound: it was; the message says when.
    """
    if done.replayed:
        with store.reading() as session:
            get(session, done.answer.id)
    return done


def _insert(
    session: Session, spec: ResolvedSpec, admitted: Admission, study: StudyRow | None = None, position: int = 0
) -> ExperimentRow:
    row = insert_experiment(session, spec, extent_of(spec), study=study, position=position, token=admitted.token)
    row.hardware = hardware_of(spec)
    return row


def extent_of(spec: ResolvedSpec) -> Extent:
    """Return the size of one repetition of a resolved spec."""
    samples = spec.iterations if takes_samples(spec) else 0
    return Extent(iterations=samples + 1, rollouts=expected_rollouts(spec))
