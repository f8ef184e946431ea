"""Experiments and studies, read with their repetitions, samples and simulators. Use cases raise StoreUnavailable."""

from collections.abc import Sequence
from typing import Any

from gaplab.schemas.differences import SpecDiff
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
from gaplab.schemas.spec import SpecRead
from gaplab.services.experiments.hiding import hidden
from gaplab.services.experiments.views import view_experiments, view_repetition, view_studies
from gaplab.services.specs.differences import SpecColumn, differences
from gaplab.services.specs.shortening import experiment_spec, study_spec
from gaplab.services.store.cursor import next_cursor
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries import attempts, results
from gaplab.services.store.queries.experiments import (
    Noun,
    experiments_of,
    get,
    get_experiment,
    get_study,
    repetitions_of,
)
from gaplab.services.store.session import Session, Store, snapshot
from gaplab.services.store.stored_specs import without_truth


@snapshot
def read_experiment(session: Session, experiment_id: str, *, reveal: bool = False) -> ExperimentRead:
    """Return the experiment with its progress; `reveal` includes hidden parameters of reality.

    Raises:
        NotFound: no such experiment.
    """
    return view_experiments(session, [get_experiment(session, experiment_id)], reveal=reveal)[0]


@snapshot
def read_study(session: Session, study_id: str, *, reveal: bool = False) -> StudyRead:
    """Return the study with its experiments and their progress; `reveal` includes hidden parameters of reality.

    Raises:
        NotFound: no such study.
    """
    return view_studies(session, [get_study(session, study_id)], reveal=reveal)[0]


@snapshot
def read_spec(session: Session, noun: Noun, id_: str, *, reveal: bool = False) -> SpecRead:
    """Return the spec of an experiment or a study; `reveal` includes hidden parameters of reality.

    Raises:
        NotFound: there is none with this id.
    """
    row = get(session, noun, id_)
    if isinstance(row, StudyRow):
        return study_spec(row.name, _shown_specs(session, experiments_of(session, [row.id]), reveal=reveal))
    return experiment_spec(*_shown_specs(session, [row], reveal=reveal))


def _shown_specs(session: Session, rows: Sequence[ExperimentRow], *, reveal: bool) -> list[dict[str, Any]]:
    secret = frozenset() if reveal else hidden(session, rows)
    return [without_truth(row.spec) if row.id in secret else row.spec for row in rows]


@snapshot
def list_repetitions(session: Session, experiment_id: str) -> tuple[RepetitionRead, ...]:
    """Return the repetitions of an experiment, by number.

    Raises:
        NotFound: no such experiment.
    """
    secret = bool(hidden(session, [get_experiment(session, experiment_id)]))
    return tuple(view_repetition(row, secret=secret) for row in repetitions_of(session, experiment_id))


@snapshot
def list_samples(
    session: Session,
    experiment_id: str,
    *,
    repetition: int | None = None,
    kind: MeasurementKind | None = None,
    limit: int = 1000,
    cursor: str | None = None,
) -> Page[SampleRead]:
    """Return a page of real-world evaluations, by repetition and in the order of the log.

    Raises:
        NotFound: no such experiment.
        InvalidSpec: the cursor is invalid, or of another list.
    """
    get_experiment(session, experiment_id)
    rows = results.page_of_samples(
        session, experiment_id, repetition=repetition, kind=kind, limit=limit + 1, cursor=cursor
    )
    return Page(items=rows[:limit], next=next_cursor(rows, limit, results.cursor_of))


@snapshot
def list_simulators(
    session: Session,
    experiment_id: str,
    *,
    repetition: int | None = None,
    iteration: int | None = None,
    limit: int = 1000,
    cursor: str | None = None,
) -> Page[SimulatorRead]:
    """Return a page of tuned simulators, by repetition, iteration and rank.

    Raises:
        NotFound: no such experiment.
        InvalidSpec: the cursor is invalid, or of another list.
    """
    row = get_experiment(session, experiment_id)
    rows = results.page_of_simulators(
        session, row, repetition=repetition, iteration=iteration, limit=limit + 1, cursor=cursor
    )
    return Page(items=rows[:limit], next=next_cursor(rows, limit, results.cursor_of))


@snapshot
def list_attempts(session: Session, experiment_id: str, repetition: int) -> tuple[AttemptRead, ...]:
    """Return the attempts at a repetition: its supervisors, times and endings.

    Raises:
        NotFound: no such experiment, or no such repetition of it.
    """
    secret = bool(hidden(session, [get_experiment(session, experiment_id)]))
    return attempts.attempts_of(session, experiment_id, repetition, secret=secret)


def read_differences(store: Store, studies: Sequence[str], experiments: Sequence[str]) -> SpecDiff:
    """Return the settings that differ between studies and experiments, or within a single study.

    Raises:
        NotFound: one of them does not exist.
        InvalidSpec: there is only one experiment to compare.
    """
    loaded = [read_study(store, id) for id in studies]
    columns = [
        SpecColumn(study.id, study.name, tuple(experiment.spec for experiment in study.experiments)) for study in loaded
    ]
    if len(loaded) == 1 and not experiments:
        columns = [_column(experiment) for experiment in loaded[0].experiments]
    return differences([*columns, *(_column(read_experiment(store, id)) for id in experiments)])


def _column(experiment: ExperimentRead) -> SpecColumn:
    return SpecColumn(experiment.id, experiment.name, (experiment.spec,))
