"""Files beside measurements of a robot on a bench, like traces and photographs."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from pydantic import Field

from gaplab.api.http.attachments import saved_as
from gaplab.api.http.dependencies import Id, LimitsDep, Parameters, StoreDep
from gaplab.api.http.problems import Responses, documented
from gaplab.schemas.measurements import AttachmentRead
from gaplab.services.measuring import attachments

router = APIRouter(prefix="/attachments", tags=["bench"])

_BINARY = {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}}

_FILE: Responses = {200: {"description": "the file", "content": {k: v | {"example": "…"} for k, v in _BINARY.items()}}}


class AttachmentQuery(Parameters):
    """The name of a file."""

    name: str = Field(min_length=1, max_length=200, description="name of the file")


@router.post(
    "",
    status_code=201,
    summary="Store an attachment",
    responses=documented(413, 422, 429),
    openapi_extra={"requestBody": {"required": True, "content": _BINARY}},
)
def store_attachment(
    query: Annotated[AttachmentQuery, Query()], request: Request, store: StoreDep, limits: LimitsDep
) -> AttachmentRead:
    """Store a file, sent as the body, under the hash of its content; answers name it by that."""
    content, media_type = request.state.body.read(), request.headers.get("content-type", "application/octet-stream")
    most = limits.unnamed_attachment_bytes
    return attachments.store_attachment(store, content, query.name, media_type[:100], most)


@router.get("/{id}", summary="Read an attachment", response_class=Response, responses={**_FILE, **documented(404)})
def read_attachment(id: Id, store: StoreDep) -> Response:
    """Return a stored file, to be saved: a browser must not run what somebody sent."""
    found, content = attachments.read_attachment(store, id)
    headers = {"Content-Disposition": saved_as(found.name)}
    return Response(content, media_type="application/octet-stream", headers=headers)
