"""Figures as data that a browser or a notebook draws with Plotly."""

from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen, Read


class Chart(Frozen):
    """Arguments of `Plotly.newPlot` and `plotly.graph_objects.Figure`."""

    data: tuple[dict[str, Any], ...] = Field(examples=[({"type": "scatter", "x": (0, 1), "y": (0.9, 1.2)},)])
    layout: dict[str, Any] = Field(
        description="layout without template, font and colours: the page sets those", examples=[{}]
    )


class TableRead(Read):
    """The numbers of a figure, as text."""

    head: tuple[str, ...] = Field(examples=[("Curve", "Mean")])
    rows: tuple[tuple[str, ...], ...] = Field(examples=[(("Simulated fit", "1.2"),)])


class FigureRead(Read):
    """A figure for a page that has Plotly."""

    figure: Chart
    title: str = Field(examples=["Fig. 4"])
    caption: str = Field(
        description="number of repetitions and meaning of the bands", examples=["Mean over 40 repetitions."]
    )
    alt: str = Field(
        description="one sentence that describes the figure, for screen readers",
        examples=["Simulated fit rises from 0.9 to 1.2."],
    )
    empty: bool = Field(description="true while there is nothing to draw")
    table: TableRead | None = Field(None, description="the numbers of the figure")
