"""Archived studies, which lists leave out. Nothing else about them changes, and it can be undone."""

from sqlalchemy import update

from gaplab.schemas.events import EventKind
from gaplab.schemas.records import StudyRead
from gaplab.services.core.errors import Conflict
from gaplab.services.experiments.views import view
from gaplab.services.store.clock import now
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries.events import note
from gaplab.services.store.queries.experiments import Members, lock, members, whole
from gaplab.services.store.session import Session, transaction


@transaction
def archive(session: Session, id_: str, *, archived: bool = True) -> StudyRead:
    """Archive a study once all of its experiments have ended, or undo that; doing it twice changes nothing.

    Raises:
        NotFound: no such study.
        Conflict: an experiment of it has not ended, or the id is that of one of its experiments.
        StoreUnavailable: the database cannot be used now.
    """
    found = whole(session, id_)
    states = lock(session, found.ids)
    if archived and (open_ := sorted({state.value for state in states.values() if not state.ended})):
        msg = f"{found} is {' and '.join(open_)} and cannot be archived: wait for its end, or cancel it first"
        raise Conflict(msg)
    _move(session, found, archived=archived)
    return view(session, found)[0]


def show_again(session: Session, experiment: ExperimentRow) -> None:
    """Undo the archiving of the study of an experiment that is computed again: work must not be hidden."""
    _move(session, members(session, experiment.study_id), archived=False)


def _move(session: Session, found: Members, *, archived: bool) -> None:
    """Note since when a study is archived, or that it is not any more."""
    row, study = StudyRow, found.study
    missing = row.archived_at.is_(None) if archived else row.archived_at.is_not(None)
    moved = update(row).where(row.id == study.id, missing).values(archived_at=now() if archived else None)
    if session.scalar(moved.returning(row.id)) is not None:
        session.refresh(study)
        for id_ in sorted(found.ids):
            note(session, EventKind.ARCHIVED if archived else EventKind.UNARCHIVED, id_)
