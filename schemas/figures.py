"""Figures as data: what a browser or a notebook draws with Plotly."""

from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen


class Chart(Frozen):
    """What `Plotly.newPlot` and `plotly.graph_objects.Figure` take."""

    data: tuple[dict[str, Any], ...] = Field(examples=[({"type": "scatter", "x": (0, 1), "y": (0.9, 1.2)},)])
    layout: dict[str, Any] = Field(
        description="without template, font and colours of its own, which the page sets", examples=[{}]
    )


class TableRead(Frozen):
    """The numbers of a figure in words."""

    head: tuple[str, ...] = Field(examples=[("Curve", "Mean")])
    rows: tuple[tuple[str, ...], ...] = Field(examples=[(("Simulated fit", "1.2"),)])


class FigureRead(Frozen):
    """A figure for a page that knows Plotly."""

    figure: Chart
    title: str = Field(examples=["Fig. 4"])
    caption: str = Field(
        description="how many repetitions there are, and what the bands are", examples=["Mean over 40 repetitions."]
    )
    alt: str = Field(
        description="what it shows in a sentence, for those who cannot see it",
        examples=["Simulated fit rises from 0.9 to 1.2."],
    )
    empty: bool = Field(description="there is nothing to draw yet")
    table: TableRead | None = Field(default=None, description="its numbers")
