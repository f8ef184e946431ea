"""The page at `/`: static files without data, open to everyone; the page asks the API like any client."""

import json
from functools import cache
from pathlib import Path
from typing import Final

from fastapi import FastAPI
from fastapi.responses import HTMLResponse

from gaplab.api.http.assets import Assets, modules_of, version_of
from gaplab.api.http.security_headers import page
from gaplab.services.figures.words import PROPER

FILES: Final = Path(__file__).parents[1] / "dashboard"
SCRIPT: Final = "app.js"
PLOTLY: Final = FILES.parents[1] / "services" / "figures" / "plotly" / "library"


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
