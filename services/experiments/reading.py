"""Experiments and studies, read with their repetitions, samples and simulators.

Use cases raise NotFound if nothing has the id.
"""

from collections.abc import Sequence

from gaplab.schemas.differences import SpecDiff
from gaplab.schemas.records import AttemptRead, ExperimentRead, RepetitionRead, StudyRead
from gaplab.schemas.spec import SpecRead
from gaplab.services.experiments.views import hidden, view, view_experiments, view_repetition
from gaplab.services.specs.differences import SpecColumn, differences
from gaplab.services.specs.stored_specs import without_truth
from gaplab.services.specs.submitted import part_of, to_submit_again, without_parameters
from gaplab.services.store.queries import attempts, results
from gaplab.services.store.queries.experiments import get_experiment, members, repetitions_of
from gaplab.services.store.session import Session, Store, snapshot


@snapshot
def read(session: Session, id_: str, *, reveal: bool = False) -> StudyRead:
    """Return a study, or one experiment of it as a study of one; `reveal` includes hidden parameters of reality."""
    return view(session, members(session, id_), reveal=reveal)[0]


@snapshot
def read_experiment(session: Session, experiment_id: str, *, reveal: bool = False) -> ExperimentRead:
    """Return the experiment with its progress; `reveal` includes hidden parameters of reality."""
    return view_experiments(session, [get_experiment(session, experiment_id)], reveal=reveal)[0]


@snapshot
def read_spec(session: Session, id_: str, *, reveal: bool = False) -> SpecRead:
    """Return the spec of a study, or of one experiment of it, to submit it again; `reveal` includes what is hidden."""
    found = members(session, id_)
    specs, given = [row.spec for row in found.experiments], found.study.submitted
    if given is not None:
        given = part_of(given, [row.position for row in found.experiments], alone=found.one is not None)
    if not reveal and hidden(session, found.experiments):
        specs, given = [without_truth(each) for each in specs], given and without_parameters(given)
    return to_submit_again(found.named.name, given, specs)


@snapshot
def list_repetitions(session: Session, experiment_id: str) -> tuple[RepetitionRead, ...]:
    """Return the repetitions of an experiment, by number."""
    secret = bool(hidden(session, [get_experiment(session, experiment_id)]))
    return tuple(view_repetition(row, secret=secret) for row in repetitions_of(session, experiment_id))


list_samples = snapshot(results.page_of_samples)
list_simulators = snapshot(results.page_of_simulators)


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
        InvalidSpec: there is only one experiment to compare.
    """
    studies = [read(store, id_) for id_ in dict.fromkeys(ids)]
    columns = [SpecColumn(each.id, each.name, tuple(member.spec for member in each.experiments)) for each in studies]
    if len(studies) == 1:
        columns = [SpecColumn(each.id, each.name, (each.spec,)) for each in studies[0].experiments]
    return differences(columns)
