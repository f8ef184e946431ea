"""Deletion of experiments and studies that have ended, with all of their results.

What they share with others stays: provenances and sensitivity checks, which are about machines and robots, and files
that answers of others name. Events stay too, because their numbers have no gaps; the last one says that the experiment
was deleted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import delete, or_, select

from gaplab.schemas.editing import DeletionRead
from gaplab.schemas.events import EventKind
from gaplab.services.core.errors import Conflict, Forbidden
from gaplab.services.store.clock import moment
from gaplab.services.store.models import (
    AnswerRow,
    AttemptRow,
    Base,
    BranchRow,
    CheckpointRow,
    DeletionRow,
    ExperimentProvenanceRow,
    ExperimentRow,
    IterationRow,
    MeasurementRow,
    RepetitionRow,
    RequestRow,
    SimulatorRow,
    StudyRow,
)
from gaplab.services.store.queries import attachments
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import experiments_of, get_experiment, get_study, lock
from gaplab.services.store.session import Session, transaction
from gaplab.services.store.statements import storable

_OF_REPETITIONS: tuple[type[Base], ...] = (
    AnswerRow,
    RequestRow,
    BranchRow,
    MeasurementRow,
    SimulatorRow,
    IterationRow,
    CheckpointRow,
    AttemptRow,
)
"""Tables of results, each before the tables that it refers to."""


_SQL = {"synchronize_session": False}


@dataclass(frozen=True)
class Deleter:
    """Who deletes.

    Attributes:
        token: id of the token; None without one.
        may_delete_all: whether it may delete what others have submitted.
    """

    token: str | None
    may_delete_all: bool = False


@transaction
def delete_experiment(session: Session, experiment_id: str, by: Deleter) -> DeletionRead:
    """Delete an experiment with its results; deleting it twice changes nothing, and returns the same.

    Raises:
        NotFound: no such experiment, and none was deleted.
        Forbidden: others have submitted it.
        Conflict: it has not ended, still holds hardware, or is the only one of its study.
    """
    _lock(session, experiment_id)
    if before := _deleted(session, experiment_id):
        return before
    experiment = get_experiment(session, experiment_id)
    if experiment.study_id and len(experiments_of(session, [experiment.study_id])) == 1:
        msg = f"experiment {experiment_id!r} is the only one of study {experiment.study_id!r}: delete the study"
        raise Conflict(msg)
    _delete(session, [experiment], by, f"experiment {experiment_id!r}")
    return _bury(session, experiment, experiment.study_id, by)


@transaction
def delete_study(session: Session, study_id: str, by: Deleter) -> DeletionRead:
    """Delete a study with its experiments and their results; deleting it twice changes nothing, and returns the same.

    Raises:
        NotFound: no such study, and none was deleted.
        Forbidden: others have submitted an experiment of it.
        Conflict: an experiment of it has not ended, or still holds hardware.
    """
    _lock(session, study_id)
    if before := _deleted(session, study_id):
        return before
    study = get_study(session, study_id)
    experiments = experiments_of(session, [study_id])
    _delete(session, experiments, by, f"study {study_id!r}")
    for experiment in experiments:
        _bury(session, experiment, study_id, by)
    session.execute(delete(StudyRow).where(StudyRow.id == study_id), execution_options=_SQL)
    return _bury(session, study, None, by)


def _lock(session: Session, id_: str) -> None:
    """Lock the experiments of a study, or an experiment with all others of its study.

    What is read later in the transaction counts no experiment that another transaction deletes at the same time.
    """
    row, named = ExperimentRow, storable(id_)
    study = select(row.study_id).where(row.id == named).scalar_subquery()
    which = or_(row.id == named, row.study_id == named, row.study_id == study)
    lock(session, session.scalars(select(row.id).where(which)).all())


def _deleted(session: Session, id_: str) -> DeletionRead | None:
    row = session.get(DeletionRow, storable(id_))
    return _view(row) if row else None


def _delete(session: Session, experiments: Sequence[ExperimentRow], by: Deleter, what: str) -> None:
    """Delete experiments with all rows that belong to them alone.

    Raises:
        Forbidden: the deleter may not.
        Conflict: one has not ended, or still holds hardware.
    """
    if not by.may_delete_all and any(experiment.token_id != by.token for experiment in experiments):
        msg = f"{what} was submitted with another token: only that token, or an admin's, may delete it"
        raise Forbidden(msg)
    ids = [experiment.id for experiment in experiments]
    states = lock(session, ids)
    if open_ := sorted({state.value for state in states.values() if not state.ended}):
        raise Conflict(f"{what} is {' and '.join(open_)} and cannot be deleted: cancel it first, and then delete it")
    row = RepetitionRow
    if session.scalar(select(row.id).where(row.experiment_id.in_(ids), row.hardware.is_not(None)).limit(1)):
        raise Conflict(f"{what} still holds hardware, whose worker is stopping: delete it in a moment")
    repetitions = select(row.id).where(row.experiment_id.in_(ids)).scalar_subquery()
    once_named = attachments.named(session, repetitions)
    for table in _OF_REPETITIONS:
        session.execute(delete(table).where(table.__table__.c.repetition_id.in_(repetitions)), execution_options=_SQL)
    attachments.remove_unnamed(session, once_named)
    for table in (RepetitionRow, ExperimentProvenanceRow):
        session.execute(delete(table).where(table.experiment_id.in_(ids)), execution_options=_SQL)
    session.execute(delete(ExperimentRow).where(ExperimentRow.id.in_(ids)), execution_options=_SQL)


def _bury(session: Session, row: ExperimentRow | StudyRow, study: str | None, by: Deleter) -> DeletionRead:
    """Record that a row was deleted; the last event of an experiment says so too."""
    deleted = DeletionRow(id=row.id, study_id=study, name=row.name, token_id=by.token, deleted_at=moment(session))
    session.add(deleted)
    session.flush()
    if isinstance(row, ExperimentRow):
        note(session, EventKind.DELETED, row.id, name=row.name)
    return _view(deleted)


def _view(row: DeletionRow) -> DeletionRead:
    return DeletionRead(id=row.id, name=row.name, study=row.study_id, deleted_at=row.deleted_at)
