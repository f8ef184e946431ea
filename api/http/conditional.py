"""Entity tags, so that clients neither load the same answer twice nor overwrite an edit that they have not seen.

A tag is `"EDITS.DIGEST"`: the number of edits by people, and a digest of the whole answer. `If-None-Match` compares the
whole tag. `If-Match` compares the edits alone, so that the progress of an experiment refuses no edit.
"""

import re
from collections.abc import Collection
from hashlib import sha256
from typing import Annotated

from fastapi import Header, Request, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel

from gaplab.api.http.problems import Responses
from gaplab.services.core.errors import GaplabError

IfMatch = Annotated[
    str | None,
    Header(alias="If-Match", max_length=1_000, description="the `ETag` of what you edit, or `*` for any version"),
]

TAGGED: Responses = {200: {"headers": {"ETag": {"description": "of the answer", "schema": {"type": "string"}}}}}
CACHED: Responses = TAGGED | {304: {"description": "The answer is still the one that `If-None-Match` names"}}

_TAG = re.compile(r'(?:W/)?"(\d{1,9})\.[0-9a-f]+"')


class ConditionMissing(GaplabError):
    """A change lacks the condition `If-Match`."""

    kind, title = "condition-missing", "The edit needs the header If-Match"


def tagged(request: Request, answer: BaseModel, edits: int = 0) -> Response:
    """Return the answer with its tag, or 304 without a body if `If-None-Match` has that tag or `*`."""
    return tagged_response(request, JSONResponse(answer.model_dump(mode="json")), edits)


def tagged_response(request: Request, response: Response, edits: int = 0) -> Response:
    """Return a response with its tag, as `tagged` does."""
    tag = f'"{edits}.{sha256(response.body).hexdigest()[:16]}"'
    headers = {"ETag": tag, "Cache-Control": "private, no-cache"}
    known = _listed(request.headers.get("if-none-match", "")) if request.method == "GET" else []
    if tag in known or known == ["*"]:
        return Response(status_code=304, headers=headers)
    response.headers.update(headers)
    return response


def starting_from(if_match: str | None) -> Collection[int] | None:
    """Return the numbers of edits that a change may start from; None for any.

    Raises:
        ConditionMissing: the request has no `If-Match`.
    """
    if if_match is None:
        raise ConditionMissing("an edit needs the header If-Match: the ETag of what you edit, or * for any version")
    if if_match.strip() == "*":
        return None
    return {int(match[1]) for match in map(_TAG.fullmatch, _listed(if_match)) if match}


def _listed(tags: str) -> list[str]:
    return [tag.strip().removeprefix("W/") for tag in tags.split(",")]
