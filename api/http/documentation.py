"""The pages that document the API, served from an installed package: they work where there is no internet."""

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.docs import get_redoc_html, get_swagger_ui_html
from fastapi.responses import HTMLResponse

from gaplab.api.http.access import OPEN
from gaplab.api.http.assets import Assets
from gaplab.api.http.problems import documented
from gaplab.api.http.security_headers import page
from gaplab.schemas.problems import Problem

ASSETS = "/assets/docs"


def install(app: FastAPI) -> None:
    """Serve /docs and /redoc, and describe problems in /openapi.json."""
    app.mount(ASSETS, Assets(packages=[("fastapi_offline", "static")]), name="docs_assets")
    app.add_api_route("/docs", _docs, include_in_schema=False)
    app.add_api_route("/redoc", _redoc, include_in_schema=False)
    _describe_problems(app)


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


def _page(made: HTMLResponse) -> HTMLResponse:
    return page(bytes(made.body).decode())


def _describe_problems(app: FastAPI) -> None:
    """Put the problem's schema where the answers refer to it, and drop the framework's own shape of errors."""
    generate = app.openapi

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            document = generate()
            schemas = document["components"]["schemas"]
            problem = Problem.model_json_schema(ref_template="#/components/schemas/{model}", mode="serialization")
            schemas |= problem.pop("$defs") | {"Problem": problem}
            _drop_foreign_errors(document)
            _describe_access(document)
        assert app.openapi_schema is not None
        return app.openapi_schema

    app.openapi = openapi  # type: ignore[method-assign]


def _describe_access(document: dict[str, Any]) -> None:
    """Say which token each endpoint wants, and what happens without."""
    about = "made by `gaplab token create`; on loopback none is needed until the first is made"
    document["components"]["securitySchemes"] = {"token": {"type": "http", "scheme": "bearer", "description": about}}
    for path, operations in document["paths"].items():
        for operation in operations.values():
            operation["security"] = [] if path in OPEN else [{"token": []}, {}]
            if path not in OPEN:
                operation["responses"] |= {str(status): each for status, each in documented(401, 403).items()}


def _drop_foreign_errors(document: dict[str, Any]) -> None:
    """Say 422 where a query, a header or a body can be wrong, in our own shape; an id is never wrong, only unknown."""
    for foreign in ("HTTPValidationError", "ValidationError"):
        document["components"]["schemas"].pop(foreign, None)
    for operations in document["paths"].values():
        for operation in operations.values():
            answers = operation["responses"]
            if "application/json" in answers.get("422", {}).get("content", {}):
                del answers["422"]
            if "requestBody" in operation or any(each["in"] != "path" for each in operation.get("parameters", ())):
                answers |= {str(status): each for status, each in documented(422).items()}
