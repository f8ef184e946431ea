"""Experiments and studies: submit, look at, cancel. Each function is one transaction.

All of them raise StoreUnavailable while the database cannot be used.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.records import (
    AttemptRead,
    ExperimentRead,
    MeasurementKind,
    Page,
    RepetitionRead,
    SampleRead,
    SimulatorRead,
    StudyRead,
)
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.experiments import checks
from gaplab.services.experiments.idempotency import Once, once
from gaplab.services.experiments.lifecycle import ask_experiment
from gaplab.services.experiments.limits import FREELY, Admission, check_extent, check_load
from gaplab.services.experiments.listing import list_experiments as list_experiments
from gaplab.services.experiments.listing import list_studies as list_studies
from gaplab.services.experiments.views import view_experiments, view_repetition, view_studies
from gaplab.services.specs.resolution import expected_rollouts, is_direct, resolve_experiment, resolve_study
from gaplab.services.store.queries import attempts, experiments, results
from gaplab.services.store.queries.experiments import Extent
from gaplab.services.store.session import Session, Store

R = TypeVar("R")


def submit_experiment(store: Store, spec: ExperimentSpec) -> ExperimentRead:
    """Store the resolved experiment, its repetitions QUEUED, and with it a sensitivity check unless there is one.

    Raises:
        InvalidSpec: with everything that is wrong with it.
    """
    return admit_experiment(store, spec, FREELY).answer


def admit_experiment(store: Store, spec: ExperimentSpec, admitted: Admission) -> Once[ExperimentRead]:
    """Submit it within limits, and once for each idempotency key.

    Raises:
        InvalidSpec: with everything that is wrong with it.
        LimitReached: there is no room for it now.
        KeyReused: the key stands for another request.
    """
    resolved = resolve_experiment(spec)
    check_extent([resolved], admitted.limits)

    def create(session: Session) -> ExperimentRead:
        check_load(session, [resolved], admitted)
        row = experiments.insert_experiment(session, resolved, extent_of(resolved), token=admitted.token)
        checks.queue_for(session, [row])
        return view_experiments(session, [row])[0]

    return once(store, admitted, spec, ExperimentRead, create)


def submit_study(store: Store, spec: StudySpec) -> StudyRead:
    """Store the study, an experiment for each of its strategies, and a sensitivity check unless there is one.

    Raises:
        InvalidSpec: with everything that is wrong with it.
    """
    return admit_study(store, spec, FREELY).answer


def admit_study(store: Store, spec: StudySpec, admitted: Admission) -> Once[StudyRead]:
    """Submit it within limits, and once for each idempotency key.

    Raises:
        InvalidSpec: with everything that is wrong with it.
        LimitReached: there is no room for it now.
        KeyReused: the key stands for another request.
    """
    resolved = resolve_study(spec)
    check_extent(resolved, admitted.limits)

    def create(session: Session) -> StudyRead:
        check_load(session, resolved, admitted)
        study = experiments.insert_study(session, spec.name or "study")
        rows = [
            experiments.insert_experiment(
                session, each, extent_of(each), study=study, position=position, token=admitted.token
            )
            for position, each in enumerate(resolved)
        ]
        checks.queue_for(session, rows)
        return view_studies(session, [study])[0]

    return once(store, admitted, spec, StudyRead, create)


def read_experiment(store: Store, experiment_id: str, *, reveal: bool = False) -> ExperimentRead:
    """The experiment with its progress; reality's parameters are null until it has ended, or with `reveal`.

    Raises:
        NotFound: no such experiment.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        return view_experiments(session, [row], reveal=reveal)[0]


def read_study(store: Store, study_id: str, *, reveal: bool = False) -> StudyRead:
    """The study with its experiments and their progress; `reveal` as of an experiment.

    Raises:
        NotFound: no such study.
    """
    with store.reading() as session:
        row = experiments.get_study(session, study_id)
        return view_studies(session, [row], reveal=reveal)[0]


def list_repetitions(store: Store, experiment_id: str) -> tuple[RepetitionRead, ...]:
    """The repetitions of an experiment, by number.

    Raises:
        NotFound: no such experiment.
    """
    with store.reading() as session:
        experiments.get_experiment(session, experiment_id)
        return tuple(map(view_repetition, experiments.repetitions_of(session, experiment_id)))


def list_samples(
    store: Store,
    experiment_id: str,
    *,
    repetition: int | None = None,
    kind: MeasurementKind | None = None,
    limit: int = 1000,
    cursor: str | None = None,
) -> Page[SampleRead]:
    """A page of real-world evaluations, samples and probes, by repetition and in the order of the log.

    Raises:
        NotFound: no such experiment.
        InvalidSpec: a cursor that no page gave.
    """
    with store.reading() as session:
        experiments.get_experiment(session, experiment_id)
        rows = results.page_of_samples(
            session, experiment_id, repetition=repetition, kind=kind, limit=limit + 1, cursor=cursor
        )
    return Page(items=rows[:limit], next=_next(rows, limit, results.cursor_of))


def list_simulators(
    store: Store,
    experiment_id: str,
    *,
    repetition: int | None = None,
    iteration: int | None = None,
    limit: int = 1000,
    cursor: str | None = None,
) -> Page[SimulatorRead]:
    """A page of tuned simulators, by repetition, iteration and rank.

    Raises:
        NotFound: no such experiment.
        InvalidSpec: a cursor that no page gave.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        rows = results.page_of_simulators(
            session, row, repetition=repetition, iteration=iteration, limit=limit + 1, cursor=cursor
        )
    return Page(items=rows[:limit], next=_next(rows, limit, results.cursor_of))


def list_attempts(store: Store, experiment_id: str, repetition: int) -> tuple[AttemptRead, ...]:
    """The attempts at a repetition: who had it, from when to when, and how it ended.

    Raises:
        NotFound: no such experiment, or no such repetition of it.
    """
    with store.reading() as session:
        experiments.get_experiment(session, experiment_id)
        return attempts.attempts_of(session, experiment_id, repetition)


def cancel_experiment(store: Store, experiment_id: str) -> ExperimentRead:
    """Call the experiment off; what is stored stays, and a running repetition is refused at its next write.

    Raises:
        NotFound: no such experiment.
        Conflict: it has ended.
    """
    return ask_experiment(store, experiment_id, Verb.CANCEL)


def extent_of(spec: ExperimentSpec) -> Extent:
    """How much one repetition of a resolved spec is."""
    samples = 0 if is_direct(spec) else spec.iterations or 0
    return Extent(iterations=samples + 1, rollouts=expected_rollouts(spec))


def _next(rows: Sequence[R], limit: int, cursor_of: Callable[[R], str]) -> str | None:
    """The cursor of the page that follows; `rows` has one more than the page if there is one."""
    return cursor_of(rows[limit - 1]) if len(rows) > limit else None
