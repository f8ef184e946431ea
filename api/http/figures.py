"""How every figure is asked for, and answered in the format that is wanted."""

from typing import Any, Literal

from fastapi import Response
from pydantic import Field

from gaplab.api.http.dependencies import Parameters
from gaplab.api.http.problems import documented
from gaplab.api.http.security_headers import page
from gaplab.schemas.figures import Chart, FigureRead, TableRead
from gaplab.services.figures.marks import FigureDefinition
from gaplab.services.figures.matplotlib.files import render_file
from gaplab.services.figures.plotly.chart import chart
from gaplab.services.figures.plotly.html import render_html
from gaplab.services.figures.words import TITLE

MEDIA_TYPES = {
    "json": "application/json",
    "html": "text/html",
    "svg": "image/svg+xml",
    "png": "image/png",
    "pdf": "application/pdf",
}


class Drawing(Parameters):
    """How a figure is wanted; each kind adds what it draws."""

    format: Literal["html", "json", "svg", "png", "pdf"] = Field(
        default="html", description="a page that needs nothing else, data for Plotly, or a file for a paper"
    )
    title: str | None = Field(default=None, max_length=TITLE, description="above it; left out: what it is of")
    width: float = Field(default=3.5, ge=2.5, le=20, description="of a file, in inches: a column has 3.5, a page 7.2")
    caption: bool = Field(default=True, description="of a file: whether the caption is drawn beneath")


def answer(figure: FigureDefinition, query: Drawing) -> Response:
    """The figure in the format that was asked for."""
    if query.format == "html":
        return page(render_html(figure))
    media_type = MEDIA_TYPES[query.format]
    if query.format == "json":
        return Response(read(figure).model_dump_json(), media_type=media_type)
    drawn = render_file(figure, query.format, width_in=query.width, caption=query.caption)
    disposition = {"Content-Disposition": f'inline; filename="gaplab-{figure.name}.{query.format}"'}
    return Response(drawn, media_type=media_type, headers=disposition)


def read(figure: FigureDefinition) -> FigureRead:
    """The figure as JSON has it."""
    table = figure.table and TableRead(head=figure.table.head, rows=figure.table.rows)
    return FigureRead(
        figure=Chart.model_validate(chart(figure)),
        title=figure.title,
        caption=figure.caption,
        alt=figure.alt,
        empty=figure.empty,
        table=table,
    )


_EXAMPLE = FigureRead(
    figure=Chart(
        data=({"type": "scatter", "name": "Simulated fit", "x": [0, 1], "y": [0.9, 1.2]},),
        layout={"xaxis": {"title": {"text": "Number of real-world evaluations"}}},
    ),
    title="Fig. 4",
    caption="Mean over 40 repetitions; bands: 95 % interval of the mean.",
    alt="Fitness in reality (m/s) against number of real-world evaluations: Simulated fit goes from 0.9 to 1.2.",
    empty=False,
)


def responses() -> dict[int | str, dict[str, Any]]:
    """What an endpoint of a figure says in the documentation about its answers."""
    text, binary = {"type": "string"}, {"type": "string", "format": "binary"}
    content = {
        "application/json": {"example": _EXAMPLE.model_dump(mode="json")},
        "text/html": {"schema": text, "example": "<!doctype html><html lang='en'>…"},
        "image/svg+xml": {"schema": text, "example": "<svg xmlns='http://www.w3.org/2000/svg'>…"},
        "image/png": {"schema": binary, "example": "PNG…"},
        "application/pdf": {"schema": binary, "example": "%PDF…"},
    }
    about = {
        "description": "A page that needs nothing else, data for Plotly, or a file for a paper",
        "content": content,
    }
    return {200: about, **documented(404, 422)}
