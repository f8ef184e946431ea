"""Entity tags: what is not sent again, and what is not overwritten unseen.

A tag is `"EDITS.DIGEST"`: how often people edited the thing, and a digest of the whole answer. `If-None-Match` compares
all of it. `If-Match` compares the edits: a change guards against the changes of other people, and an experiment that
computes meanwhile refuses none.
"""

import re
from collections.abc import Collection
from hashlib import sha256
from typing import Annotated

from fastapi import Header, Request, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel

from gaplab.services.core.errors import ConditionMissing

IfMatch = Annotated[
    str | None,
    Header(alias="If-Match", max_length=1_000, description="the `ETag` that was looked at, or `*` for whatever it is"),
]

HEADERS = {"ETag": {"description": "of what is shown", "schema": {"type": "string"}}}
NOT_MODIFIED = {304: {"description": "It is what `If-None-Match` names"}}

_TAG = re.compile(r'(?:W/)?"(\d{1,9})\.[0-9a-f]+"')


def tagged(request: Request, shown: BaseModel, edits: int = 0) -> Response:
    """What is shown, with its tag; only the tag if the reader has it already, or says `*`: whatever there is."""
    content = shown.model_dump(mode="json")
    answer = JSONResponse(content)
    tag = f'"{edits}.{sha256(answer.body).hexdigest()[:16]}"'
    headers = {"ETag": tag, "Cache-Control": "private, no-cache"}
    known = _listed(request.headers.get("if-none-match", "")) if request.method == "GET" else []
    if tag in known or known == ["*"]:
        return Response(status_code=304, headers=headers)
    answer.headers.update(headers)
    return answer


def starting_from(if_match: str | None) -> Collection[int] | None:
    """The numbers of edits that a change may start from; None for any.

    Raises:
        ConditionMissing: the change does not say.
    """
    if if_match is None:
        msg = "a change needs the header If-Match with the ETag that you looked at, or * to change it whatever it is"
        raise ConditionMissing(msg)
    if if_match.strip() == "*":
        return None
    return {int(each[1]) for each in map(_TAG.fullmatch, _listed(if_match)) if each}


def _listed(tags: str) -> list[str]:
    return [each.strip().removeprefix("W/") for each in tags.split(",")]
