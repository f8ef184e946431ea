"""Answers that are more than a body: with an entity tag, as a file to save, or of a request that may be repeated.

By tags, clients neither load the same answer twice nor overwrite an edit that they have not seen. A tag is
`"EDITS.DIGEST"`: the number of edits by people, and a digest of the whole answer. `If-None-Match` compares the whole
tag. `If-Match` compares the edits alone, so that the progress of an experiment refuses no edit.
"""

import re
from collections.abc import Collection
from hashlib import sha256
from typing import Annotated, TypeVar
from urllib.parse import quote

from fastapi import Header, Request, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel

from gaplab.api.http.problems import Responses
from gaplab.schemas.base import Frozen
from gaplab.services.core.errors import GaplabError
from gaplab.services.experiments.idempotency import Once

R = TypeVar("R", bound=Frozen)

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
    response = JSONResponse(answer.model_dump(mode="json"))
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


def attachment(text: str, media_type: str, name: str) -> Response:
    """Return a text as a file of this name."""
    return Response(text, media_type=media_type, headers={"Content-Disposition": f'attachment; filename="{name}"'})


def saved_as(name: str) -> str:
    """Return the Content-Disposition of a file that a browser saves under this name, in any script.

    Source: RFC 6266, section 4.3, and RFC 8187: `filename` is ASCII, for what does not know `filename*`.
    """
    clean = "".join(sign if sign.isprintable() and sign not in "/\\" else "_" for sign in name)
    plain = "".join(sign if sign.isascii() and (sign.isalnum() or sign in "._-") else "_" for sign in clean)
    return f"attachment; filename=\"{plain}\"; filename*=UTF-8''{quote(clean, safe='')}"


def created(once: Once[R], response: Response, location: str) -> R:
    """Return the answer to a submission; headers say where it is, and whether an earlier request submitted it."""
    response.headers["Location"] = location
    return once_answered(once, response)


def once_answered(once: Once[R], response: Response) -> R:
    """Return the answer; a header says whether an earlier request had it."""
    if once.replayed:
        response.headers["Idempotent-Replayed"] = "true"
    return once.answer
