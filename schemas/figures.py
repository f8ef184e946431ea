"""Figures as data that a browser or a notebook draws with Plotly."""

from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen


class Chart(Frozen):
    """Arguments of `Plotly.newPlot` and `plotly.graph_objects.Figure`."""

    data: tuple[dict[str, Any], ...]
    layout: dict[str, Any] = Field(description="layout without template, font and colours: the page sets those")


class TableRead(Frozen):
    """The numbers of a figure, as text."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


class FigureRead(Frozen):
    """A figure for a page that knows Plotly."""

    figure: Chart
    title: str
    caption: str = Field(description="number of repetitions and meaning of the bands")
    alt: str = Field(description="one sentence that describes the figure, for screen readers")
    empty: bool = Field(description="true while there is nothing to draw")
    table: TableRead | None = Field(default=None, description="the numbers of the figure")
