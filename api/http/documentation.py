"""The pages that document the API, from an installed package: they need no internet."""

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.docs import get_redoc_html, get_swagger_ui_html
from fastapi.responses import HTMLResponse

from gaplab.api.http.access import OPEN
from gaplab.api.http.assets import Assets
from gaplab.api.http.problems import documented
from gaplab.api.http.security_headers import page
from gaplab.schemas.mistakes import Problem

ASSETS = "/assets/docs"
ABOUT_TOKENS = "created by `gaplab token create`; on loopback none is needed until the first exists"


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
    for path, operations in document["paths"].items():
        for operation in operations.values():
            operation["security"] = [] if path in OPEN else [{"token": []}, {}]
            responses = operation["responses"]
            if "application/json" in responses.get("422", {}).get("content", {}):
                del responses["422"]
            statuses = [*([] if path in OPEN else [401, 403]), 422]
            responses |= {str(status): each for status, each in documented(*statuses).items()}
