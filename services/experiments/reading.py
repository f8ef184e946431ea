"""Experiments and studies, read with their repetitions, samples and simulators. Use cases raise StoreUnavailable."""

from collections.abc import Sequence

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
from gaplab.services.experiments.views import view, view_experiments, view_repetition
from gaplab.services.specs.differences import SpecColumn, differences
from gaplab.services.specs.shortening import shortest
from gaplab.services.specs.stored_specs import without_truth
from gaplab.services.store.cursor import next_cursor
from gaplab.services.store.queries import attempts, results
from gaplab.services.store.queries.experiments import get_experiment, members, repetitions_of
from gaplab.services.store.session import Session, Store, snapshot


@snapshot
def read(session: Session, id_: str, *, reveal: bool = False) -> StudyRead:
    """Return a study, or one experiment of it as a study of one; `reveal` includes hidden parameters of reality.

    Raises:
        NotFound: no such study or experiment.
    """
    return view(session, members(session, id_), reveal=reveal)[0]


@snapshot
def read_experiment(session: Session, experiment_id: str, *, reveal: bool = False) -> ExperimentRead:
    """Return the experiment with its progress; `reveal` includes hidden parameters of reality.

    Raises:
        NotFound: no such experiment.
    """
    return view_experiments(session, [get_experiment(session, experiment_id)], reveal=reveal)[0]


@snapshot
def read_spec(session: Session, id_: str, *, reveal: bool = False) -> SpecRead:
    """Return the spec of a study, or of one experiment of it; `reveal` includes hidden parameters of reality.

    Raises:
        NotFound: no such study or experiment.
    """
    found = members(session, id_)
    secret = frozenset() if reveal else hidden(session, found.experiments)
    specs = [without_truth(row.spec) if row.id in secret else row.spec for row in found.experiments]
    return shortest(found.named.name, specs)


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


def read_differences(store: Store, ids: Sequence[str]) -> SpecDiff:
    """Return the settings that differ between studies and experiments, or within a single study.

    Raises:
        NotFound: one of them does not exist.
        InvalidSpec: there is only one experiment to compare.
    """
    studies = [read(store, id_) for id_ in dict.fromkeys(ids)]
    columns = [SpecColumn(each.id, each.name, tuple(member.spec for member in each.experiments)) for each in studies]
    if len(studies) == 1:
        columns = [SpecColumn(each.id, each.name, (each.spec,)) for each in studies[0].experiments]
    return differences(columns)
