"""Archives: out with everything of an experiment or a study, and back in."""

from collections.abc import Iterator
from tempfile import TemporaryFile
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import StreamingResponse
from starlette.concurrency import run_in_threadpool

from gaplab.api.http import examples
from gaplab.api.http.dependencies import Id, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.archives import ImportRead
from gaplab.services import archives
from gaplab.services.archives import Archive

router = APIRouter(tags=["archives"])

MEDIA_TYPE = "application/zip"

_CHUNK = 2**16
_FILE: dict[str, Any] = {MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}}}
_EXPORTED: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "A zip of JSON Lines and Parquet, a member for each table; `manifest.json` has their SHA-256",
        "content": {MEDIA_TYPE: {**_FILE[MEDIA_TYPE], "example": "PK…"}},
    }
}


@router.get(
    "/experiments/{id}/export",
    summary="Export an experiment",
    response_class=Response,
    responses={**_EXPORTED, **documented(404)},
)
def export_experiment(id: Id, store: StoreDep) -> Response:
    """Everything of an experiment at one moment; reality's parameters are null until they may be shown."""
    return _sent(archives.export_experiment(store, id))


@router.get(
    "/studies/{id}/export",
    summary="Export a study",
    response_class=Response,
    responses={**_EXPORTED, **documented(404)},
)
def export_study(id: Id, store: StoreDep) -> Response:
    """Everything of a study and of its experiments at one moment."""
    return _sent(archives.export_study(store, id))


@router.post(
    "/import",
    status_code=201,
    summary="Import an archive",
    responses={
        201: examples.shown(
            ImportRead(study="0a1b2c3d4e", experiments=("01f2e3d4c5",), renamed={"kx3t9vbm2q": "01f2e3d4c5"}),
            "It is stored, and exists at `Location`",
        ),
        **documented(409, 413, 422),
    },
    openapi_extra={"requestBody": {"required": True, "content": _FILE}},
)
async def import_archive(store: StoreDep, request: Request, response: Response) -> ImportRead:
    """Store what an export wrote, to the last bit, all of it or nothing; what had not ended arrives called off."""
    with TemporaryFile() as file:
        async for chunk in request.stream():
            file.write(chunk)
        file.seek(0)
        stored = await run_in_threadpool(archives.import_archive, store, file)
    route, found = ("read_study", stored.study) if stored.study else ("read_experiment", stored.experiments[0])
    response.headers["Location"] = str(request.app.url_path_for(route, id=found))
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
