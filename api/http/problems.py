"""Errors as RFC 9457 problem details. The HTTP status of each error is defined here and nowhere else."""

import json
import logging
from collections.abc import Mapping, Sequence
from html import escape
from http import HTTPStatus
from string import Template
from typing import Any
from uuid import uuid4

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import Response
from starlette.exceptions import HTTPException

from gaplab.api.http.security_headers import page
from gaplab.api.http.violations import MOST_ERRORS, explain, finite, without_consequences
from gaplab.schemas.mistakes import Problem, SpecError
from gaplab.services.core.errors import GaplabError, InvalidSpec, Violation
from gaplab.services.experiments.limits import CostUnconfirmed
from gaplab.services.nesting import MOST_LEVELS
from gaplab.services.specs.blame import is_external, raised
from gaplab.services.store.texts import brief

Responses = dict[int | str, dict[str, Any]]
"""Documented responses of an endpoint, by status, as FastAPI takes them."""

MEDIA_TYPE = "application/problem+json"

STATUSES: dict[str, int] = {
    "invalid-spec": 422,
    "cost-unconfirmed": 422,
    "invalid-robot-file": 422,
    "invalid-pool": 422,
    "not-found": 404,
    "conflict": 409,
    "changed": 412,
    "condition-missing": 428,
    "key-reused": 422,
    "limit-reached": 429,
    "unauthenticated": 401,
    "forbidden": 403,
    "invalid-archive": 422,
    "store-unavailable": 503,
    "supervisor-unavailable": 503,
    "engine-unavailable": 422,
    "engine-interrupted": 503,
}
"""The status of each kind of error."""

INVALID_SPEC = (422, InvalidSpec.kind, InvalidSpec.title)
INVALID_REQUEST = (422, "invalid-request", "The request is invalid")

FRAMEWORK: dict[int, tuple[int, str, str]] = {
    400: (422, "not-json", "The body is not JSON"),  # FastAPI answers 400 only to a body that it cannot parse
    404: (404, "not-found", "There is no such address"),
    405: (405, "method-not-allowed", "The address does not support this method"),
    413: (413, "body-too-large", "The body is too large"),
    415: (415, "not-json", "The body is not sent as JSON"),
}

DETAILS: dict[int, str] = {
    400: f"The body cannot be parsed as JSON in UTF-8, nested at most {MOST_LEVELS} levels deep.",
    404: "There is nothing at {path}; /docs lists all addresses.",
    405: "{method} is not allowed at {path}.",
}

logger = logging.getLogger(__name__)


def install(app: FastAPI) -> None:
    """Answer every error of the app with a problem, FastAPI's own errors included."""
    app.add_exception_handler(GaplabError, of_gaplab)
    app.add_exception_handler(RequestValidationError, _of_validation)
    app.add_exception_handler(HTTPException, _of_framework)
    app.add_exception_handler(Exception, _of_bug)


def response(problem: Problem, headers: dict[str, str] | None = None) -> Response:
    """Return the response for a problem; `?` stands for what is not a character, like half a surrogate."""
    text = json.dumps(problem.model_dump(mode="json"), ensure_ascii=False, allow_nan=False)
    return Response(text.encode(errors="replace"), problem.status, headers, MEDIA_TYPE)


def problem(status: int, kind: str, title: str, detail: str, errors: Sequence[SpecError] = ()) -> Problem:
    """Return a problem with at most `MOST_ERRORS` errors."""
    name = f"urn:gaplab:problem:{kind}"
    return Problem(type=name, title=title, status=status, detail=brief(detail), errors=tuple(errors[:MOST_ERRORS]))


def documented(*statuses: int) -> Responses:
    """Return the documented problems of an endpoint: these and the two that any endpoint can have."""
    schema = {"schema": {"$ref": "#/components/schemas/Problem"}}
    return {
        status: {"description": HTTPStatus(status).phrase, "content": {MEDIA_TYPE: schema}}
        for status in sorted({*statuses, 500, 503})
    }


def of_gaplab(request: Request, error: Exception) -> Response:
    """Return the response to a request that gaplab refused."""
    assert isinstance(error, GaplabError)
    if not error.kind:
        return _of_bug(request, error)
    kind = STATUSES[error.kind], error.kind, error.title
    if not isinstance(error, InvalidSpec):
        refused = problem(*kind, str(finite(str(error) or type(error).__name__)))
        return _shown(request, refused, _headers(request, error, refused.status))
    errors = [_spec_error(violation) for violation in error.violations]
    in_body = any(each.pointer.startswith("/") or not each.pointer for each in errors)
    is_named = in_body or isinstance(error, CostUnconfirmed)
    return response(problem(*(kind if is_named else INVALID_REQUEST), _sentence(errors, len(errors)), errors))


def _shown(request: Request, refused: Problem, headers: dict[str, str]) -> Response:
    """Return the problem; as a page with ways out of it if a person looks for something that does not exist."""
    if refused.status != HTTPStatus.NOT_FOUND or request.method != "GET" or not takes_pages(request.headers):
        return response(refused, headers)
    root = escape(request.scope.get("root_path", ""))
    answer = page(_PAGE.substitute(title=escape(refused.title), detail=escape(refused.detail), root=root))
    answer.status_code = refused.status
    return answer


def takes_pages(headers: Mapping[str, str]) -> bool:
    """Return whether a browser asks for what a person looks at, by its `Accept`."""
    accepted = headers.get("accept", "")
    return "text/html" in accepted and "json" not in accepted


def _headers(request: Request, error: GaplabError, status: int) -> dict[str, str]:
    if status == HTTPStatus.UNAUTHORIZED:
        reason = ', error="invalid_token"' if "authorization" in request.headers else ""
        return {"WWW-Authenticate": f'Bearer realm="gaplab"{reason}'}
    if status == HTTPStatus.FORBIDDEN:
        return {"WWW-Authenticate": 'Bearer realm="gaplab", error="insufficient_scope"'}
    return {"Retry-After": str(error.retry_after_s)} if error.retry_after_s is not None else {}


def _spec_error(violation: Violation) -> SpecError:
    permitted = violation.permitted if isinstance(violation.permitted, str | None) else tuple(violation.permitted)
    message = brief(violation.message)
    return SpecError.filled_from(violation, value=finite(violation.value), message=message, permitted=permitted)


def _of_validation(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    found = without_consequences(error.errors())
    if found[0]["type"] == "json_invalid":
        where, what = found[0]["loc"][-1], found[0]["ctx"]["error"]
        return response(problem(*FRAMEWORK[400], f"The body is not JSON: {what} at character {where}."))
    errors = [_spec_error(explain(each, error.body, request)) for each in found[:MOST_ERRORS]]
    kind = INVALID_SPEC if all(each["loc"][0] == "body" for each in found) else INVALID_REQUEST
    if any(each["loc"] == ("body",) and isinstance(each["input"], bytes) for each in found):
        kind = FRAMEWORK[415]  # FastAPI did not parse it
    return response(problem(*kind, _sentence(errors, len(found)), errors))


def _sentence(errors: Sequence[SpecError], count: int) -> str:
    first = errors[0]
    others = f" (and {count - 1} more)" if count > 1 else ""
    return f"{first.pointer}: {first.message}{others}" if first.pointer else f"{first.message}{others}"


def _of_framework(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    phrase = HTTPStatus(error.status_code).phrase
    fallback = (error.status_code, phrase.lower().replace(" ", "-"), phrase)
    kind = FRAMEWORK.get(error.status_code, fallback)
    template = DETAILS.get(error.status_code, str(error.detail).replace("{", "{{").replace("}", "}}"))
    detail = template.format(path=finite(request.url.path), method=request.method)
    return _shown(request, problem(*kind, detail), dict(error.headers or {}))


def _of_bug(request: Request, error: Exception) -> Response:
    """Answer an unexpected error with the number of an incident, under which the log has its message.

    Its cause is the service, or an external plug-in, which is named with the line that raised the error.
    """
    incident = uuid4().hex[:8]
    logger.error("incident %s at %s", incident, request.url.path, exc_info=error)
    kind, title, cause = "internal-error", "The service failed", ""
    if is_external(error):
        kind, title, cause = "plugin-failed", "A plug-in failed", f": {raised(error)}"
    detail = f"{title}{cause}; the log of the service has the details under incident {incident}."
    return response(problem(500, kind, title, detail))


_PAGE = Template("""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>$title · gaplab</title>
<style>body { font: 1rem/1.5 system-ui, sans-serif; max-width: 40rem; margin: 4rem auto; padding: 0 1rem; }</style>
</head>
<body>
<main>
<h1>$title</h1>
<p>$detail</p>
<p><a href="$root/">To the experiments</a> · <a href="$root/docs">The addresses of the API</a></p>
</main>
</body>
</html>
""")
