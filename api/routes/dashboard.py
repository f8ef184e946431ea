"""The page at `/`: static files without data, open to everyone; the page asks the API like any client."""

import json
import re
from functools import cache
from pathlib import Path
from typing import Final

from fastapi import FastAPI
from fastapi.responses import HTMLResponse, RedirectResponse
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gaplab.api.http.assets import Assets, modules_of, version_of
from gaplab.api.http.problems import takes_pages
from gaplab.api.http.security_headers import page
from gaplab.services.figures.words import PROPER

FILES: Final = Path(__file__).parents[1] / "dashboard"
SCRIPT: Final = "app.js"
PLOTLY: Final = FILES.parents[1] / "services" / "figures" / "plotly" / "library"

VIEWS: Final = re.compile(r"/(studies|experiments)/[A-Za-z0-9_-]{1,64}|/studies")
"""The addresses of the API that have a view of their own in the page."""


class BrowserRedirect:
    """Middleware that leads a browser from an address of the API to its view in the page, which asks for a token."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request; the answer says that it depends on `Accept` where it does."""
        path = str(scope.get("path", "")).removeprefix(scope.get("root_path", ""))
        answers, has_view = self.app, VIEWS.fullmatch(path) and scope.get("method") in {"GET", "HEAD"}
        if has_view and takes_pages(Headers(scope=scope)):
            home = "../" * (path.count("/") - 1) or "./"  # relative: a proxy may serve gaplab below a prefix
            answers = RedirectResponse(f"{home}#{path if path != '/studies' else '/'}", status_code=303)

        async def varying(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).add_vary_header("Accept")
            await send(message)

        await answers(scope, receive, varying if has_view else send)


def install(app: FastAPI) -> None:
    """Serve the page, its modules, and Plotly."""
    app.add_api_route("/", _index, include_in_schema=False)
    app.mount("/assets/dashboard", Assets(directory=FILES), name="dashboard")
    app.mount("/assets/{version}/dashboard", Assets(directory=FILES), name="versioned_dashboard")
    app.mount("/assets/plotly", Assets(directory=PLOTLY), name="plotly")


def _index() -> HTMLResponse:
    return page(_html().replace("assets/dashboard/", f"assets/{version_of(FILES)}/dashboard/"))


@cache
def _html() -> str:
    """Return the page with the modules of its script, and of those that each view adds when it is shown."""
    always = modules_of(FILES, SCRIPT)
    views = {
        view.stem: [path for path in modules_of(FILES, f"views/{view.name}") if path not in always]
        for view in sorted(FILES.glob("views/*.js"))
    }
    preloads = "\n".join(f'  <link rel="modulepreload" href="assets/dashboard/{path}">' for path in always[1:])
    html = (FILES / "index.html").read_text(encoding="utf-8").replace("{plotly}", version_of(PLOTLY))
    html = html.replace("{names}", json.dumps(PROPER)).replace("{modules}", json.dumps(views))
    return html.replace("  <!-- preloads -->", preloads)
