"""What goes wrong, as RFC 9457 problem details. The HTTP status of each error stands here and nowhere else."""

import logging
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from typing import Any
from uuid import uuid4

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from gaplab.api.http.violations import MOST_ERRORS, explain, finite, without_consequences
from gaplab.schemas.problems import Problem, SpecError
from gaplab.services.core.errors import (
    Changed,
    ConditionMissing,
    Conflict,
    EngineInterrupted,
    EngineUnavailable,
    Forbidden,
    GaplabError,
    InvalidArchive,
    InvalidSpec,
    KeyReused,
    LimitReached,
    NotFound,
    StoreUnavailable,
    Unauthenticated,
)

MEDIA_TYPE = "application/problem+json"

KINDS: dict[type[GaplabError], tuple[int, str, str]] = {
    InvalidSpec: (422, "invalid-spec", "This cannot be run as it is"),
    NotFound: (404, "not-found", "There is no such thing"),
    Conflict: (409, "conflict", "Its present state forbids it"),
    Changed: (412, "changed", "It was changed meanwhile"),
    ConditionMissing: (428, "condition-missing", "The change must say what it starts from"),
    KeyReused: (422, "key-reused", "The idempotency key is taken"),
    LimitReached: (429, "limit-reached", "Too much is under way"),
    Unauthenticated: (401, "unauthenticated", "A token is needed"),
    Forbidden: (403, "forbidden", "The token does not permit this"),
    InvalidArchive: (422, "invalid-archive", "This archive cannot be read"),
    StoreUnavailable: (503, "store-unavailable", "The database cannot be used now"),
    EngineUnavailable: (422, "engine-unavailable", "An engine is not installed here"),
    EngineInterrupted: (503, "engine-interrupted", "The physics ended before it answered"),
}

INVALID_REQUEST = (422, "invalid-request", "This cannot be answered as it is asked")

FRAMEWORK: dict[int, tuple[int, str, str]] = {
    400: (422, "not-json", "The body is not JSON"),  # all that the framework calls 400 is a body that it cannot parse
    404: (404, "not-found", "There is no such address"),
    405: (405, "method-not-allowed", "This address does not take that method"),
    413: (413, "body-too-large", "The body is too large"),
    415: (415, "not-json", "The body is not sent as JSON"),
}

DETAILS: dict[int, str] = {
    400: "The body cannot be parsed as JSON in UTF-8.",
    404: "Nothing is served at {path}; /docs lists what is.",
    405: "{method} is not allowed at {path}.",
}

logger = logging.getLogger(__name__)


def install(app: FastAPI) -> None:
    """Let every error of the app leave as a problem, the framework's own included."""
    app.add_exception_handler(GaplabError, of_gaplab)
    app.add_exception_handler(RequestValidationError, _of_validation)
    app.add_exception_handler(HTTPException, _of_framework)
    app.add_exception_handler(Exception, _of_accident)


def response(problem: Problem, headers: dict[str, str] | None = None) -> JSONResponse:
    """The problem as it goes out."""
    return JSONResponse(
        problem.model_dump(mode="json"), status_code=problem.status, headers=headers, media_type=MEDIA_TYPE
    )


def problem(status: int, kind: str, title: str, detail: str, errors: Sequence[SpecError] = ()) -> Problem:
    """A problem of a stable type; of very many errors it carries the first."""
    name = f"urn:gaplab:problem:{kind}"
    return Problem(type=name, title=title, status=status, detail=detail, errors=tuple(errors[:MOST_ERRORS]))


def documented(*statuses: int) -> dict[int | str, dict[str, object]]:
    """What an endpoint says in `/docs` about the problems it answers with."""
    schema = {"schema": {"$ref": "#/components/schemas/Problem"}}
    return {
        status: {"description": HTTPStatus(status).phrase, "content": {MEDIA_TYPE: schema}}
        for status in sorted({*statuses, 500, 503})
    }


def of_gaplab(request: Request, error: Exception) -> JSONResponse:
    """The answer to a request that gaplab refused."""
    kind = next((KINDS[each] for each in type(error).__mro__ if each in KINDS), None)
    if kind is None:
        return _of_accident(request, error)
    errors = _violations(error) if isinstance(error, InvalidSpec) else []
    kind = (
        INVALID_REQUEST
        if errors and not any(each.pointer.startswith("/") or not each.pointer for each in errors)
        else kind
    )
    detail = _sentence(errors, len(errors)) if errors else _readable(error)
    return response(problem(*kind, detail, errors), _headers(request, error))


def _headers(request: Request, error: Exception) -> dict[str, str]:
    match error:
        case StoreUnavailable() | EngineInterrupted():
            return {"Retry-After": "5"}
        case LimitReached(retry_after_s=int(seconds)):
            return {"Retry-After": str(seconds)}
        case Unauthenticated():
            shown = ', error="invalid_token"' if "authorization" in request.headers else ""
            return {"WWW-Authenticate": f'Bearer realm="gaplab"{shown}'}
        case Forbidden():
            return {"WWW-Authenticate": 'Bearer realm="gaplab", error="insufficient_scope"'}
    return {}


def _violations(error: InvalidSpec) -> list[SpecError]:
    return [
        SpecError(
            pointer=each.pointer,
            value=finite(each.value),
            message=each.message,
            permitted=each.permitted if isinstance(each.permitted, str | None) else tuple(each.permitted),
            nearest=each.nearest,
        )
        for each in error.violations
    ]


def _of_validation(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    found = without_consequences(error.errors())
    if found[0]["type"] == "json_invalid":
        where, what = found[0]["loc"][-1], found[0]["ctx"]["error"]
        return response(problem(*FRAMEWORK[400], f"The body is not JSON: {what} at character {where}."))
    errors = [explain(each, error.body, request) for each in found[:MOST_ERRORS]]
    if _is_not_json(found):
        return response(problem(*FRAMEWORK[415], _sentence(errors, len(found)), errors))
    in_body = all(each["loc"][0] == "body" for each in found)
    kind = KINDS[InvalidSpec] if in_body else INVALID_REQUEST
    return response(problem(*kind, _sentence(errors, len(found)), errors))


def _is_not_json(found: Sequence[Mapping[str, Any]]) -> bool:
    """Whether there is a body that its header calls something else, so that nobody parsed it."""
    return any(each["loc"] == ("body",) and isinstance(each["input"], bytes) for each in found)


def _sentence(errors: Sequence[SpecError], count: int) -> str:
    first = errors[0]
    others = f" (and {count - 1} more)" if count > 1 else ""
    return f"{first.pointer}: {first.message}{others}" if first.pointer else f"{first.message}{others}"


def _of_framework(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    phrase = HTTPStatus(error.status_code).phrase
    fallback = (error.status_code, phrase.lower().replace(" ", "-"), phrase)
    kind = FRAMEWORK.get(error.status_code, fallback)
    template = DETAILS.get(error.status_code, str(error.detail).replace("{", "{{").replace("}", "}}"))
    detail = template.format(path=finite(request.url.path), method=request.method)
    return response(problem(*kind, detail), dict(error.headers or {}))


def _of_accident(request: Request, error: Exception) -> JSONResponse:
    """Nothing of the inside leaks: the traceback is in the log, under the number that the answer carries."""
    incident = uuid4().hex[:8]
    logger.error("incident %s at %s", incident, request.url.path, exc_info=error)
    detail = f"Something went wrong inside the service; its log says more, under {incident}."
    return response(problem(500, "internal-error", "The service failed", detail))


def _readable(error: Exception) -> str:
    return str(finite(str(error) or type(error).__name__))
