"""The query parameters that all figures share, and the answer in the requested format."""

from collections.abc import Callable
from typing import Literal, TypeVar

from fastapi import Response
from pydantic import Field, TypeAdapter

from gaplab.api.http.dependencies import Parameters
from gaplab.api.http.documentation import sent
from gaplab.api.http.problems import documented
from gaplab.api.http.security_headers import page
from gaplab.schemas.figures import Chart, FigureRead, TableRead
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.figures.marks import FigureDefinition
from gaplab.services.figures.matplotlib.files import Font, Look, render_file
from gaplab.services.figures.matplotlib.page_layout import SIZE_PT
from gaplab.services.figures.plotly.chart import chart
from gaplab.services.figures.plotly.html import render_html
from gaplab.services.figures.words import TITLE, heading
from gaplab.services.waiting_line import WaitingLine

T = TypeVar("T")
DRAWING = TypeAdapter(tuple[FigureDefinition, Look])
"""A figure and the look of its files as JSON."""

MEDIA_TYPES = {
    "json": "application/json",
    "html": "text/html",
    "svg": "image/svg+xml",
    "png": "image/png",
    "pdf": "application/pdf",
    "marks": "application/vnd.gaplab.marks+json",
}

_DRAWING = WaitingLine("figures")
"""Of one process: Matplotlib draws one figure at a time."""

_FORMATS = "a self-contained page, JSON for Plotly, a file for a paper, or the marks that `gaplab.Figure` draws from"


SENT = sent(
    {
        "text/html": "<!doctype html><html lang='en'>…",
        "image/svg+xml": "<svg xmlns='http://www.w3.org/2000/svg'>…",
        "image/png": "PNG…",
        "application/pdf": "%PDF…",
        "application/vnd.gaplab.marks+json": '[{"name": "curves", …}, {"width_in": 3.5, …}]',
    },
    _FORMATS.capitalize(),
) | documented(429)
"""The documented answers of a figure's endpoint."""


class FigureQuery(Parameters):
    """How to draw a figure; each kind of figure adds what to draw."""

    format: Literal["html", "json", "svg", "png", "pdf", "marks"] = Field("html", description=_FORMATS)
    title: str | None = Field(None, max_length=TITLE, description="text above the figure; left out: what it shows")
    width: float = Field(3.5, ge=2.5, le=20, description="width of a file in inches; a column has 3.5, a page 7.2")
    height: float | None = Field(None, ge=1, le=20, description="height of its panels; left out: as needed")
    caption: bool = Field(True, description="whether a file has the caption below the figure")
    font: Font = Field("DejaVu Sans", description="family of the letters of a file; STIXGeneral goes with Times")
    font_size: float = Field(SIZE_PT, ge=4, le=24, description="size of the text of a file in points")
    xlabel: str | None = Field(None, max_length=TITLE, description="label of the horizontal axis; left out: its own")
    ylabel: str | None = Field(None, max_length=TITLE, description="label of the vertical axis, likewise")
    xlim: str | None = Field(
        None, max_length=60, description="ends of the horizontal axis, like `0,10`; left out: its own"
    )
    ylim: str | None = Field(None, max_length=60, description="ends of the vertical axis, likewise")

    def changed(self, figure: FigureDefinition) -> FigureDefinition:
        """Return the figure with these labels and limits.

        Raises:
            InvalidSpec: it cannot have them.
        """
        for which, label, ends in (("x", self.xlabel, self.xlim), ("y", self.ylabel, self.ylim)):
            given = {} if label is None else {"label": heading(label)}
            try:
                limits = {} if ends is None else {"limits": tuple(map(float, ends.split(",")))}
                figure = figure.with_axis(which, **given, **limits)
            except ValueError as error:
                raise InvalidSpec(
                    [Violation(f"{which}{'label' if ends is None else 'lim'}", ends or label, str(error))]
                ) from error
        return figure


def answer(figure: FigureDefinition, query: FigureQuery) -> Response:
    """Return the figure in the requested format.

    Raises:
        LimitReached: too many files are being drawn.
        InvalidSpec: the figure cannot have a label or limits that are asked for.
    """
    figure, form, media_type = query.changed(figure), query.format, MEDIA_TYPES[query.format]
    if form == "html":
        return page(render_html(figure))
    if form == "json":
        return Response(read(figure).model_dump_json(), media_type=media_type)
    look = Look(query.width, query.height, query.caption, query.font, query.font_size)
    if form == "marks":
        return Response(DRAWING.dump_json((figure, look)), media_type=media_type)
    drawn = in_turn(lambda: render_file(figure, form, look))
    disposition = {"Content-Disposition": f'inline; filename="gaplab-{figure.name}.{form}"'}
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
