"""Archived experiments and studies, which lists leave out. Nothing else about them changes, and it can be undone.

Each function is one transaction, and raises StoreUnavailable while the database cannot be used.
"""

from collections.abc import Sequence

from sqlalchemy import update

from gaplab.schemas.events import EventKind
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.services.core.errors import Conflict
from gaplab.services.experiments.views import view_experiments, view_studies
from gaplab.services.store.clock import now
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import experiments_of, get_experiment, get_study, lock
from gaplab.services.store.session import Session, transaction


@transaction
def archive_experiment(session: Session, experiment_id: str, *, archived: bool = True) -> ExperimentRead:
    """Archive an experiment that has ended, or undo that; doing it twice changes nothing.

    Raises:
        NotFound: no such experiment.
        Conflict: it has not ended.
    """
    experiment = get_experiment(session, experiment_id)
    _archive(session, [experiment], f"experiment {experiment_id!r}", archived=archived)
    return view_experiments(session, [experiment])[0]


@transaction
def archive_study(session: Session, study_id: str, *, archived: bool = True) -> StudyRead:
    """Archive a study with its experiments once all have ended, or undo that.

    Raises:
        NotFound: no such study.
        Conflict: an experiment of it has not ended.
    """
    study = get_study(session, study_id)
    _archive(session, experiments_of(session, [study_id]), f"study {study_id!r}", archived=archived)
    _mark(session, StudyRow, [study_id], archived=archived)
    session.refresh(study)
    return view_studies(session, [study])[0]


def show_again(session: Session, experiment: ExperimentRow) -> None:
    """Undo the archiving of an experiment that is computed again, and of its study: work must not be hidden."""
    if experiment.archived_at is None:
        return
    _move(session, [experiment.id], archived=False)
    session.execute(update(StudyRow).where(StudyRow.id == experiment.study_id).values(archived_at=None))
    session.refresh(experiment)


def _archive(session: Session, experiments: Sequence[ExperimentRow], what: str, *, archived: bool) -> None:
    ids = [experiment.id for experiment in experiments]
    states = lock(session, ids)
    if archived and (open_ := sorted({state.value for state in states.values() if not state.ended})):
        msg = f"{what} is {' and '.join(open_)} and cannot be archived: wait for its end, or cancel it first"
        raise Conflict(msg)
    _move(session, ids, archived=archived)
    for experiment in experiments:
        session.refresh(experiment)


def _move(session: Session, ids: Sequence[str], *, archived: bool) -> None:
    for id_ in _mark(session, ExperimentRow, ids, archived=archived):
        note(session, EventKind.ARCHIVED if archived else EventKind.UNARCHIVED, id_)


def _mark(session: Session, table: type[ExperimentRow | StudyRow], ids: Sequence[str], *, archived: bool) -> list[str]:
    """Note since when rows are archived, or that they are not any more; return the sorted ids of those that changed."""
    missing = table.archived_at.is_(None) if archived else table.archived_at.is_not(None)
    changed = update(table).where(table.id.in_(ids), missing).values(archived_at=now() if archived else None)
    return sorted(session.scalars(changed.returning(table.id)))
