"""Notes of studies, a webhook that is told of their end, archiving and deletion."""

from typing import Annotated

from fastapi import APIRouter, Body, Depends

from gaplab.api.http.dependencies import CallerDep, Id, StoreDep, of_app
from gaplab.api.http.problems import documented
from gaplab.schemas.keeping import DeletionRead, NotesRead, Role, WebhookRead, WebhookSpec
from gaplab.schemas.records import StudyRead
from gaplab.services.experiments import archiving, deletion, notes
from gaplab.services.experiments.deletion import Deleter
from gaplab.services.notifications import webhooks
from gaplab.services.settings import Notify

router = APIRouter(prefix="/studies/{id}", tags=["studies"])

NotifyDep = Annotated[Notify, of_app("notify")]
Webhook = Annotated[WebhookSpec, Body(openapi_examples=WebhookSpec.EXAMPLES)]


def _deleter(caller: CallerDep) -> Deleter:
    """Return what the caller may delete: an admin everything, others what their own token submitted."""
    return Deleter(caller.token, may_delete_all=caller.role.permits(Role.ADMIN))


DeleterDep = Annotated[Deleter, Depends(_deleter)]


@router.get("/notes", summary="Read a study's notes as HTML", responses=documented(404, 409))
def read_notes(id: Id, store: StoreDep) -> NotesRead:
    """Return the notes as HTML that is safe on a page: rendered Markdown, without scripts, images or its own HTML."""
    return notes.read(store, id)


@router.get("/webhook", summary="Read a study's webhook", responses=documented(404, 409))
def read_webhook(id: Id, store: StoreDep) -> WebhookRead:
    """Return the host that is told when all experiments of the study have ended, without the rest of the address."""
    return webhooks.read(store, id)


@router.put("/webhook", summary="Set a study's webhook", responses=documented(404, 409, 413, 415, 422))
def set_webhook(id: Id, spec: Webhook, store: StoreDep, notify: NotifyDep) -> WebhookRead:
    """Send a POST to this address when all experiments of the study have ended, as `GAPLAB_NOTIFY_HOSTS` permits."""
    return webhooks.set_webhook(store, id, spec, notify.permitted_hosts)


@router.delete("/webhook", summary="Remove a study's webhook", responses=documented(404, 409))
def drop_webhook(id: Id, store: StoreDep, notify: NotifyDep) -> WebhookRead:
    """Tell no webhook of its own when the study has ended."""
    return webhooks.set_webhook(store, id, None, notify.permitted_hosts)


@router.post(
    "/archive",
    summary="Archive a study",
    response_description="With `archived_at`",
    responses=documented(404, 409),
)
def archive_study(id: Id, store: StoreDep) -> StudyRead:
    """Leave a study whose experiments have all ended out of lists. Its address, curves and comparisons stay."""
    return archiving.archive(store, id)


@router.post(
    "/unarchive",
    summary="Unarchive a study",
    response_description="Without `archived_at`",
    responses=documented(404, 409),
)
def unarchive_study(id: Id, store: StoreDep) -> StudyRead:
    """List an archived study again."""
    return archiving.archive(store, id, archived=False)


@router.delete(
    "",
    summary="Delete a study",
    response_description="What was deleted; the same if it was deleted before",
    responses=documented(403, 404, 409),
)
def delete_study(id: Id, store: StoreDep, deleter: DeleterDep) -> DeletionRead:
    """Delete a study that has ended, or one experiment of it, with all results, for good.

    Its events stay, and the last of each experiment says so. Only the token that submitted it may do so, or an admin's.
    """
    return deletion.delete(store, id, deleter)
