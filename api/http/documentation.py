"""The OpenAPI document: what operations share is said here once; and its pages, which need no internet."""

import re
from collections.abc import Iterator
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.docs import get_redoc_html, get_swagger_ui_html
from fastapi.responses import HTMLResponse

from gaplab.api.http.access import OPEN
from gaplab.api.http.assets import Assets
from gaplab.api.http.problems import Responses, documented
from gaplab.api.http.security_headers import page
from gaplab.schemas.base import Examples, Frozen
from gaplab.schemas.mistakes import Problem

ASSETS = "/assets/docs"
ABOUT_TOKENS = "created by `gaplab token create`; on loopback none is needed until the first exists"

BYTES = {"application/zip", "application/octet-stream", "image/png", "application/pdf"}
"""Media types that are not text."""

FROM_STUDY = tuple(
    f"{verb}_study" for verb in ("read", "edit", "export", "pause", "resume", "stop", "cancel", "retry", "schedule")
)
FROM_EXPERIMENT = (
    *(*FROM_STUDY, "read_experiment", "list_repetitions", "list_samples", "list_simulators"),
    *("read_misfit", "read_curve", "read_provenance"),
)
FROM_CHECK = ("read_sensitivity",)


def leading_to(*operations: str) -> Responses:
    """Return the documented answer of a submission, which links to operations on its id: clients and tests follow."""
    parameters = {"path.id": "$response.body#/id"}
    return {202: {"links": {name: {"operationId": name, "parameters": parameters} for name in operations}}}


def content(examples: dict[str, Any]) -> dict[str, Any]:
    """Return the documented content of a body that is not one of our schemas.

    Args:
        examples: an example by media type; None for none.
    """
    found: dict[str, Any] = {}
    for media_type, example in examples.items():
        schema = {"type": "object" if media_type == "application/json" else "string"}
        schema |= {"format": "binary"} if media_type in BYTES else {}
        found[media_type] = {"schema": schema} | ({"example": example} if example else {})
    return found


def sent(examples: dict[str, Any], description: str | None = None) -> Responses:
    """Return the documented answer of an operation with `content`."""
    return {200: ({"description": description} if description else {}) | {"content": content(examples)}}


def taken(media_type: str, example: str | None = None) -> dict[str, Any]:
    """Return the documented body of an operation that takes a file."""
    return {"requestBody": {"required": True, "content": content({media_type: example})}}


def install(app: FastAPI) -> None:
    """Serve /docs and /redoc, and describe problems in /openapi.json."""
    app.mount(ASSETS, Assets(packages=[("fastapi_offline", "static")]), name="docs_assets")
    app.add_api_route("/docs", _docs, include_in_schema=False)
    app.add_api_route("/redoc", _redoc, include_in_schema=False)
    generate = app.openapi

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            _complete(generate())
        return generate()

    app.openapi = openapi  # type: ignore[method-assign]


def _docs() -> HTMLResponse:
    return _page(
        get_swagger_ui_html(
            openapi_url="openapi.json",
            title="gaplab",
            swagger_js_url=f".{ASSETS}/swagger-ui-bundle.js",
            swagger_css_url=f".{ASSETS}/swagger-ui.css",
            swagger_favicon_url=f".{ASSETS}/favicon.png",
            swagger_ui_parameters={"displayRequestDuration": True, "tryItOutEnabled": True},
        )
    )


def _redoc() -> HTMLResponse:
    return _page(
        get_redoc_html(
            openapi_url="openapi.json",
            title="gaplab",
            redoc_js_url=f".{ASSETS}/redoc.standalone.js",
            redoc_favicon_url=f".{ASSETS}/favicon.png",
            with_google_fonts=False,
        )
    )


def _page(response: HTMLResponse) -> HTMLResponse:
    return page(bytes(response.body).decode())


def _complete(document: dict[str, Any]) -> None:
    """Add the schema of problems, and the token and the problems of each endpoint, in place of FastAPI's errors."""
    components = document["components"]
    problem = Problem.model_json_schema(ref_template="#/components/schemas/{model}", mode="serialization")
    components["schemas"] |= problem.pop("$defs") | {"Problem": problem}
    for foreign in ("HTTPValidationError", "ValidationError"):
        components["schemas"].pop(foreign, None)
    components["securitySchemes"] = {"token": {"type": "http", "scheme": "bearer", "description": ABOUT_TOKENS}}
    examples = dict(_examples(Frozen))
    for path, operations in document["paths"].items():
        for operation in operations.values():
            operation["security"] = [] if path in OPEN else [{"token": []}, {}]
            responses, body = operation["responses"], operation.get("requestBody", {}).get("content", {})
            if "application/json" in responses.get("422", {}).get("content", {}):
                del responses["422"]
            responses |= {str(status): each for status, each in documented(*_statuses(path, operation)).items()}
            if body and (found := re.findall(r"schemas/(\w+)", str(body))):
                known = (examples[name] for name in found)
                body["application/json"]["examples"] = {name: each for some in known for name, each in some.items()}


def _statuses(path: str, operation: dict[str, Any]) -> Iterator[int]:
    """Yield the statuses of the problems that follow from what an operation takes."""
    yield 422
    if path not in OPEN:
        yield from (401, 403)
    if "{id}" in path or {"study", "experiment"} & {each["name"] for each in operation.get("parameters", ())}:
        yield 404
    if "requestBody" in operation:
        yield 413
    if "application/json" in operation.get("requestBody", {}).get("content", {}):
        yield 415


def _examples(schema: type[Frozen]) -> Iterator[tuple[str, Examples]]:
    """Yield the examples of the schemas of bodies, by name."""
    if hasattr(schema, "EXAMPLES"):
        yield schema.__name__, schema.EXAMPLES
    for each in schema.__subclasses__():
        yield from _examples(each)
