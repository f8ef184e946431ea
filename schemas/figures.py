"""Figures as data: what a browser or a notebook draws with Plotly."""

from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen


class Chart(Frozen):
    """What `Plotly.newPlot` and `plotly.graph_objects.Figure` take."""

    data: tuple[dict[str, Any], ...]
    layout: dict[str, Any] = Field(description="without template, font and colours of its own, which the page sets")


class TableRead(Frozen):
    """The numbers of a figure in words."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


class FigureRead(Frozen):
    """A figure for a page that knows Plotly."""

    figure: Chart
    title: str
    caption: str = Field(description="how many repetitions there are, and what the bands are")
    alt: str = Field(description="what it shows in a sentence, for those who cannot see it")
    empty: bool = Field(description="there is nothing to draw yet")
    table: TableRead | None = Field(default=None, description="its numbers")
