"""Archives: export a study with everything in it, and import it again."""

from collections.abc import Iterator
from typing import Annotated

from fastapi import APIRouter, Request, Response
from fastapi.responses import StreamingResponse

from gaplab.api.http.dependencies import Id, LimitedDep, StoreDep, of_app
from gaplab.api.http.problems import Responses, documented
from gaplab.api.routes.studies import Confirming
from gaplab.schemas.archives import ImportRead
from gaplab.services import archives
from gaplab.services.archives import Archive
from gaplab.services.waiting_line import WaitingLine

router = APIRouter(tags=["archives"])

MEDIA_TYPE = "application/zip"

_CHUNK = 2**16
_BINARY = {"schema": {"type": "string", "format": "binary"}}
_EXPORTED: Responses = {200: {"content": {MEDIA_TYPE: {**_BINARY, "example": "PK…"}}}, **documented(404, 429)}
LineDep = Annotated[WaitingLine, of_app("exports")]
_CONTENT = "A zip of one SQLite database, `study.sqlite3`, with the tables of the service"


@router.get(
    "/studies/{id}/export",
    summary="Export a study",
    response_class=Response,
    response_description=_CONTENT,
    responses=_EXPORTED,
)
def export_study(id: Id, store: StoreDep, line: LineDep) -> Response:
    """Export all of a study as of one moment, or the study with one of its experiments alone.

    Reality's parameters are null while they are hidden.
    """
    with line.turn():
        return _sent(archives.export(store, id))


@router.post(
    "/import",
    status_code=201,
    summary="Import an archive",
    response_description="Stored; its address is in `Location`",
    responses=documented(409, 413, 422, 429),
    openapi_extra={"requestBody": {"required": True, "content": {MEDIA_TYPE: _BINARY}}},
)
def import_archive(
    store: StoreDep, admitted: LimitedDep, query: Confirming, request: Request, response: Response
) -> ImportRead:
    """Store all of an exported archive, or nothing.

    Experiments that had not ended become CANCELLED; those on a bench obey the limits of a submission, and are PAUSED.
    """
    stored = archives.import_archive(store, request.state.body, query.given(admitted))
    response.headers["Location"] = str(request.app.url_path_for("read_study", id=stored.study))
    return stored


def _sent(archive: Archive) -> StreamingResponse:
    headers = {
        "Content-Disposition": f'attachment; filename="{archive.name}"',
        "Content-Length": str(archive.size),
    }
    return StreamingResponse(_chunks(archive), media_type=MEDIA_TYPE, headers=headers)


def _chunks(archive: Archive) -> Iterator[bytes]:
    with archive.file as file:
        while chunk := file.read(_CHUNK):
            yield chunk
