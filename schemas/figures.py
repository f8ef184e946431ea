"""Figures as data that a browser or a notebook draws with Plotly, and the data of the paper's Fig. 3."""

from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen


class Chart(Frozen):
    """Arguments of `Plotly.newPlot` and `plotly.graph_objects.Figure`."""

    data: tuple[dict[str, Any], ...] = Field(examples=[({"type": "scatter", "x": (0, 1), "y": (0.9, 1.2)},)])
    layout: dict[str, Any] = Field(
        description="layout without template, font and colours: the page sets those", examples=[{}]
    )


class TableRead(Frozen):
    """The numbers of a figure, as text."""

    head: tuple[str, ...] = Field(examples=[("Curve", "Mean")])
    rows: tuple[tuple[str, ...], ...] = Field(examples=[(("Simulated fit", "1.2"),)])


class FigureRead(Frozen):
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
    table: TableRead | None = Field(default=None, description="the numbers of the figure")


Values = tuple[float | None, ...]


class ToySample(Frozen):
    """A gene that was measured in reality."""

    iteration: int
    gene: float
    fitness: float | None = Field(description="null: the measurement failed")


class ToyTransfer(Frozen):
    """The fittest gene in the best simulator, with its fitness in simulation and reality."""

    gene: float
    simulated: float | None
    real: float | None = Field(description="null: not measured yet, or failed")


class ToyIteration(Frozen):
    """The toy function in one iteration of one repetition."""

    experiment: str
    name: str
    repetition: int
    iteration: int
    unit: str = Field(description="unit of fitness")
    genes: tuple[float, ...] = Field(description="genes at which the functions are evaluated")
    truth: Values | None = Field(description="the true function; null while it is hidden")
    approximations: tuple[Values, ...] = Field(description="the simulators of the iteration, best first")
    squared_error: float | None = Field(description="what tuning minimised, of the best simulator; null: no samples")
    squares: bool = Field(description="whether that is a sum of squares")
    error: float | None = Field(description="error per sample that tuning saw, of the best simulator; null: none")
    samples: tuple[ToySample, ...] = Field(description="samples up to this iteration")
    transfer: ToyTransfer | None
    limits: tuple[float, float] = Field(
        description="range of all fitnesses of the repetition, for the axis of a figure"
    )
