"""Deletion of studies, or of single experiments of them, that have ended, with all of their results.

What they share with others stays: provenances and sensitivity checks, which are about machines and robots, and files
that answers of others name. Events stay too, because their numbers have no gaps; the last one says that the experiment
was deleted.
"""

from dataclasses import dataclass

from sqlalchemy import delete as delete_from
from sqlalchemy import or_, select

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
    RepetitionRow,
    RequestRow,
    StepRow,
    StudyRow,
)
from gaplab.services.store.queries import attachments
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import Members, lock, members
from gaplab.services.store.session import Session, transaction
from gaplab.services.store.statements import storable

_OF_REPETITIONS: tuple[type[Base], ...] = (
    AnswerRow,
    RequestRow,
    BranchRow,
    StepRow,
    CheckpointRow,
    AttemptRow,
)
"""Tables of results, each before the tables that it refers to."""


_SQL = {"synchronize_session": False}


@dataclass(frozen=True)
class Deleter:
    """Who deletes, and what it may delete.

    Attributes:
        token: id of the token; None without one.
        may_delete_all: whether it may delete what others have submitted.
    """

    token: str | None
    may_delete_all: bool = False


@transaction
def delete(session: Session, id_: str, by: Deleter) -> DeletionRead:
    """Delete a study, or one experiment of it, with its results; doing it twice changes nothing, and returns the same.

    The last experiment of a study takes the study with it.

    Raises:
        NotFound: no such study or experiment, and none was deleted.
        Forbidden: others have submitted it.
        Conflict: it has not ended, or still holds hardware.
    """
    _lock(session, id_)
    if before := session.get(DeletionRow, storable(id_)):
        return _view(before)
    found = members(session, id_)
    _delete(session, found, by)
    buried = {row.id: _bury(session, row, found.study.id, by) for row in found.experiments}
    if found.one is None:
        session.execute(delete_from(StudyRow).where(StudyRow.id == found.study.id), execution_options=_SQL)
        if found.study.id not in buried:
            buried[found.study.id] = _bury(session, found.study, None, by)
    return buried[id_]


def _lock(session: Session, id_: str) -> None:
    """Lock the experiments of a study, or an experiment with all others of its study.

    What is read later in the transaction counts no experiment that another transaction deletes at the same time.
    """
    row, named = ExperimentRow, storable(id_)
    study = select(row.study_id).where(row.id == named).scalar_subquery()
    which = or_(row.id == named, row.study_id == named, row.study_id == study)
    lock(session, session.scalars(select(row.id).where(which)).all())


def _delete(session: Session, found: Members, by: Deleter) -> None:
    """Delete experiments with all rows that belong to them alone.

    Raises:
        Forbidden: the deleter may not.
        Conflict: one has not ended, or still holds hardware.
    """
    if not by.may_delete_all and any(experiment.token_id != by.token for experiment in found.experiments):
        msg = f"{found} was submitted with another token: only that token, or an admin's, may delete it"
        raise Forbidden(msg)
    ids = found.ids
    states = lock(session, ids)
    if open_ := sorted({state.value for state in states.values() if not state.ended}):
        raise Conflict(f"{found} is {' and '.join(open_)} and cannot be deleted: cancel it first, and then delete it")
    row = RepetitionRow
    if session.scalar(select(row.id).where(row.experiment_id.in_(ids), row.hardware.is_not(None)).limit(1)):
        raise Conflict(f"{found} still holds hardware, whose worker is stopping: delete it in a moment")
    repetitions = select(row.id).where(row.experiment_id.in_(ids)).scalar_subquery()
    once_named = attachments.named(session, repetitions)
    for table in _OF_REPETITIONS:
        of_them = table.__table__.c.repetition_id.in_(repetitions)
        session.execute(delete_from(table).where(of_them), execution_options=_SQL)
    attachments.remove_unnamed(session, once_named)
    for table in (RepetitionRow, ExperimentProvenanceRow):
        session.execute(delete_from(table).where(table.experiment_id.in_(ids)), execution_options=_SQL)
    session.execute(delete_from(ExperimentRow).where(ExperimentRow.id.in_(ids)), execution_options=_SQL)


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
