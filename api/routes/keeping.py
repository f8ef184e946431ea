"""Keeping experiments and studies: archive them, delete them, and read their notes."""

from typing import Annotated

from fastapi import APIRouter, Depends

from gaplab.api.http.dependencies import CallerDep, Id, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.access import Role
from gaplab.schemas.editing import DeletionRead, NotesRead
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.services.experiments import archiving, deletion, notes
from gaplab.services.experiments.deletion import Deleter

_experiment = APIRouter(prefix="/experiments/{id}", tags=["experiments"])
_study = APIRouter(prefix="/studies/{id}", tags=["studies"])

_ARCHIVED = "With `archived_at`"
_SHOWN = "Without `archived_at`"
_DELETED = "What was deleted; the same if it was deleted before"


def _deleter(caller: CallerDep) -> Deleter:
    """Return the caller as a deleter: of what its own token submitted, or an admin of everything."""
    return Deleter(caller.token, may_delete_all=caller.role.permits(Role.ADMIN))


DeleterDep = Annotated[Deleter, Depends(_deleter)]


@_experiment.get("/notes", summary="Read an experiment's notes as HTML", responses=documented(404))
def read_experiment_notes(id: Id, store: StoreDep) -> NotesRead:
    """Return the notes as HTML that is safe on a page: rendered Markdown, without scripts, images or its own HTML."""
    return notes.read(store, "experiment", id)


@_experiment.post(
    "/archive", summary="Archive an experiment", response_description=_ARCHIVED, responses=documented(404, 409)
)
def archive_experiment(id: Id, store: StoreDep) -> ExperimentRead:
    """Leave an experiment that has ended out of lists. Its address, curves and comparisons stay as they are."""
    return archiving.archive_experiment(store, id)


@_experiment.post(
    "/unarchive", summary="Unarchive an experiment", response_description=_SHOWN, responses=documented(404)
)
def unarchive_experiment(id: Id, store: StoreDep) -> ExperimentRead:
    """List an archived experiment again."""
    return archiving.archive_experiment(store, id, archived=False)


@_experiment.delete(
    "", summary="Delete an experiment", response_description=_DELETED, responses=documented(403, 404, 409)
)
def delete_experiment(id: Id, store: StoreDep, deleter: DeleterDep) -> DeletionRead:
    """Delete an experiment that has ended, with its results, for good. Its events stay, and the last one says so.

    Only the token that submitted it may do so, or an admin's.
    """
    return deletion.delete_experiment(store, id, deleter)


@_study.get("/notes", summary="Read a study's notes as HTML", responses=documented(404))
def read_study_notes(id: Id, store: StoreDep) -> NotesRead:
    """Return the notes as HTML that is safe on a page: rendered Markdown, without scripts, images or its own HTML."""
    return notes.read(store, "study", id)


@_study.post("/archive", summary="Archive a study", response_description=_ARCHIVED, responses=documented(404, 409))
def archive_study(id: Id, store: StoreDep) -> StudyRead:
    """Leave a study whose experiments have all ended out of lists, and its experiments with it."""
    return archiving.archive_study(store, id)


@_study.post("/unarchive", summary="Unarchive a study", response_description=_SHOWN, responses=documented(404))
def unarchive_study(id: Id, store: StoreDep) -> StudyRead:
    """List an archived study and its experiments again."""
    return archiving.archive_study(store, id, archived=False)


@_study.delete("", summary="Delete a study", response_description=_DELETED, responses=documented(403, 404, 409))
def delete_study(id: Id, store: StoreDep, deleter: DeleterDep) -> DeletionRead:
    """Delete a study whose experiments have all ended, with the experiments and their results, for good.

    Only the token that submitted them may do so, or an admin's.
    """
    return deletion.delete_study(store, id, deleter)


router = APIRouter(routes=_experiment.routes + _study.routes)
