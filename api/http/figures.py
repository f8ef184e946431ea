"""The query parameters that all figures share, and the answer in the requested format."""

from collections.abc import Callable
from typing import Literal, TypeVar

from fastapi import Response
from pydantic import Field

from gaplab.api.http.dependencies import Parameters
from gaplab.api.http.documentation import sent
from gaplab.api.http.problems import documented
from gaplab.api.http.security_headers import page
from gaplab.schemas.figures import Chart, FigureRead, TableRead
from gaplab.services.figures.marks import FigureDefinition
from gaplab.services.figures.matplotlib.files import render_file
from gaplab.services.figures.plotly.chart import chart
from gaplab.services.figures.plotly.html import render_html
from gaplab.services.figures.words import TITLE
from gaplab.services.waiting_line import WaitingLine

T = TypeVar("T")

MEDIA_TYPES = {
    "json": "application/json",
    "html": "text/html",
    "svg": "image/svg+xml",
    "png": "image/png",
    "pdf": "application/pdf",
}

_DRAWING = WaitingLine("figures")
"""Of one process: Matplotlib draws one figure at a time."""

_FORMATS = "a self-contained page, JSON for Plotly, or a file for a paper"


SENT = sent(
    {
        "text/html": "<!doctype html><html lang='en'>…",
        "image/svg+xml": "<svg xmlns='http://www.w3.org/2000/svg'>…",
        "image/png": "PNG…",
        "application/pdf": "%PDF…",
    },
    _FORMATS.capitalize(),
) | documented(429)
"""The documented answers of a figure's endpoint."""


class FigureQuery(Parameters):
    """How to draw a figure; each kind of figure adds what to draw."""

    format: Literal["html", "json", "svg", "png", "pdf"] = Field("html", description=_FORMATS)
    title: str | None = Field(None, max_length=TITLE, description="text above the figure; left out: what it shows")
    width: float = Field(3.5, ge=2.5, le=20, description="width of a file in inches; a column has 3.5, a page 7.2")
    caption: bool = Field(True, description="whether a file has the caption below the figure")


def answer(figure: FigureDefinition, query: FigureQuery) -> Response:
    """Return the figure in the requested format; raise LimitReached if too many files are being drawn."""
    if query.format == "html":
        return page(render_html(figure))
    media_type = MEDIA_TYPES[query.format]
    if query.format == "json":
        return Response(read(figure).model_dump_json(), media_type=media_type)
    file_format = query.format
    drawn = in_turn(lambda: render_file(figure, file_format, width_in=query.width, caption=query.caption))
    disposition = {"Content-Disposition": f'inline; filename="gaplab-{figure.name}.{query.format}"'}
    return Response(drawn, media_type=media_type, headers=disposition)


def in_turn(draw: Callable[[], T]) -> T:
    """Return what `draw` draws with Matplotlib, once it is the caller's turn.

    Raises:
        LimitReached: too many files are being drawn.
    """
    with _DRAWING.turn():
        return draw()


def read(figure: FigureDefinition) -> FigureRead:
    """Return the figure as the schema of the API."""
    table = figure.table and TableRead.filled_from(figure.table)
    return FigureRead.filled_from(figure, figure=Chart.model_validate(chart(figure)), table=table)
