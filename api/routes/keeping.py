"""Keeping studies: notes, webhooks, archived ones, deletion, export and import, and the saved views of all users."""

from collections.abc import Iterator
from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response
from fastapi.responses import StreamingResponse

from gaplab.api.http.dependencies import CallerDep, Confirming, Id, LimitedDep, StoreDep, of_app
from gaplab.api.http.documentation import sent, taken
from gaplab.api.http.problems import documented
from gaplab.schemas.access import Role
from gaplab.schemas.archives import ImportRead
from gaplab.schemas.editing import DeletionRead, NotesRead, ViewName, ViewRead, ViewSpec
from gaplab.schemas.notifications import WebhookRead, WebhookSpec
from gaplab.schemas.records import StudyRead
from gaplab.services import archives
from gaplab.services.experiments import editing, listing
from gaplab.services.experiments.editing import Deleter
from gaplab.services.notifications import webhooks
from gaplab.services.settings import Notify
from gaplab.services.waiting_line import WaitingLine

router = APIRouter(prefix="/studies/{id}", tags=["studies"])
archive_router = APIRouter(tags=["archives"])
view_router = APIRouter(prefix="/views", tags=["views"])

ARCHIVE = "application/zip"
_CHUNK = 2**16

LineDep = Annotated[WaitingLine, of_app("exports")]
NotifyDep = Annotated[Notify, of_app("notify")]


def _deleter(caller: CallerDep) -> Deleter:
    """Return what the caller may delete: an admin everything, others what their own token submitted."""
    return Deleter(caller.token, may_delete_all=caller.role.permits(Role.ADMIN))


DeleterDep = Annotated[Deleter, Depends(_deleter)]


@router.get("/notes", summary="Read a study's notes as HTML", responses=documented(409))
def read_notes(id: Id, store: StoreDep) -> NotesRead:
    """Return the notes as HTML that is safe on a page: rendered Markdown, without scripts, images or its own HTML."""
    return editing.read_notes(store, id)


@router.get("/webhook", summary="Read a study's webhook", responses=documented(409))
def read_webhook(id: Id, store: StoreDep) -> WebhookRead:
    """Return the host that is told when all experiments of the study have ended, without the rest of the address."""
    return webhooks.read(store, id)


@router.put("/webhook", summary="Set a study's webhook", responses=documented(409))
def set_webhook(id: Id, spec: WebhookSpec, store: StoreDep, notify: NotifyDep) -> WebhookRead:
    """Send a POST to this address when all experiments of the study have ended, as `GAPLAB_NOTIFY_HOSTS` permits."""
    return webhooks.set_webhook(store, id, spec, notify.permitted_hosts)


@router.delete("/webhook", summary="Remove a study's webhook", responses=documented(409))
def drop_webhook(id: Id, store: StoreDep, notify: NotifyDep) -> WebhookRead:
    """Tell no webhook of its own when the study has ended."""
    return webhooks.set_webhook(store, id, None, notify.permitted_hosts)


@router.post(
    "/archive", summary="Archive a study", response_description="With `archived_at`", responses=documented(409)
)
def archive_study(id: Id, store: StoreDep) -> StudyRead:
    """Leave a study whose experiments have all ended out of lists. Its address, curves and comparisons stay."""
    return editing.archive(store, id)


@router.post(
    "/unarchive", summary="Unarchive a study", response_description="Without `archived_at`", responses=documented(409)
)
def unarchive_study(id: Id, store: StoreDep) -> StudyRead:
    """List an archived study again."""
    return editing.archive(store, id, archived=False)


@router.delete(
    "",
    summary="Delete a study",
    response_description="What was deleted; the same if it was deleted before",
    responses=documented(409),
)
def delete_study(id: Id, store: StoreDep, deleter: DeleterDep) -> DeletionRead:
    """Delete a study that has ended, or one experiment of it, with all results, for good.

    Its events stay, and the last of each experiment says so. Only the token that submitted it may do so, or an admin's.
    """
    return editing.delete(store, id, deleter)


@archive_router.get(
    "/studies/{id}/export",
    summary="Export a study",
    response_class=Response,
    response_description="A zip of one SQLite database, `study.sqlite3`, with the tables of the service",
    responses=sent({ARCHIVE: "PK…"}) | documented(429),
)
def export_study(id: Id, store: StoreDep, line: LineDep) -> Response:
    """Export all of a study as of one moment, or the study with one of its experiments alone.

    Reality's parameters are null while they are hidden.
    """
    with line.turn():
        archive = archives.export(store, id)
    disposition = f'attachment; filename="{archive.name}"'
    headers = {"Content-Disposition": disposition, "Content-Length": str(archive.size)}

    def chunks() -> Iterator[bytes]:
        with archive.file as file:
            while chunk := file.read(_CHUNK):
                yield chunk

    return StreamingResponse(chunks(), media_type=ARCHIVE, headers=headers)


@archive_router.post(
    "/import",
    status_code=201,
    summary="Import an archive",
    response_description="Stored; its address is in `Location`",
    responses=documented(409, 429),
    openapi_extra=taken(ARCHIVE),
)
def import_archive(
    store: StoreDep, admitted: LimitedDep, query: Confirming, request: Request, response: Response
) -> ImportRead:
    """Store all of an exported archive, or nothing.

    Experiments that had not ended become CANCELLED; those on a bench obey the limits of a submission, and are PAUSED.
    """
    stored = archives.import_archive(store, request.state.body, query.given(admitted))
    response.headers["Location"] = f"/studies/{stored.study}"
    return stored


@view_router.get("", summary="List the saved views", response_description="By name")
def list_views(store: StoreDep) -> tuple[ViewRead, ...]:
    """List the saved views."""
    return listing.list_views(store)


@view_router.get("/{name}", summary="Read a saved view", responses=documented(404))
def read_view(name: ViewName, store: StoreDep) -> ViewRead:
    """Return a saved view: pass its query as `q`, and its `sort`, to the list that it shows."""
    return listing.read_view(store, name)


@view_router.put("/{name}", summary="Save a view", response_description="As it is saved", responses=documented(429))
def save_view(name: ViewName, spec: ViewSpec, store: StoreDep) -> ViewRead:
    """Save a view under this name, in place of the one that has it. Every runner may replace and delete every view."""
    return listing.save_view(store, name, spec)


@view_router.delete(
    "/{name}", summary="Delete a saved view", response_description="What it was", responses=documented(404)
)
def delete_view(name: ViewName, store: StoreDep) -> ViewRead:
    """Delete a saved view; nothing that it lists is touched."""
    return listing.delete_view(store, name)
