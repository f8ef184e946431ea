"""The page at `/`: static files without data, open to everyone; the page asks the API like any client."""

from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Final

from fastapi import FastAPI
from fastapi.responses import HTMLResponse

from gaplab.api.http.assets import Assets, version_of
from gaplab.api.http.security_headers import page

FILES: Final = Path(__file__).parents[1] / "dashboard"


def install(app: FastAPI) -> None:
    """Serve the page, its modules, and Plotly from its installed package."""
    app.add_api_route("/", _index, include_in_schema=False)
    app.mount("/assets/dashboard", Assets(directory=FILES), name="dashboard")
    app.mount("/assets/{version}/dashboard", Assets(directory=FILES), name="versioned_dashboard")
    app.mount("/assets/plotly", Assets(packages=[("plotly", "package_data")]), name="plotly")


def _index() -> HTMLResponse:
    return page(_html().replace("assets/dashboard/", f"assets/{version_of(FILES)}/dashboard/"))


@cache
def _html() -> str:
    return (FILES / "index.html").read_text(encoding="utf-8").replace("{plotly}", version("plotly"))
