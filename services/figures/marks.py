"""The parts of a figure, independent of how they are drawn.

None stands for a missing value: it interrupts a line, and is left out among points. No number is nan or infinite.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any, ClassVar

from gaplab.services.figures.style import INK, Style

Number = float | None


def check_numbers(name: str, parts: Sequence[Sequence[Number]], optional: Sequence[Sequence[object]] = ()) -> None:
    """Refuse numbers that JSON does not have, and parts of different lengths; optional parts may be empty.

    Raises:
        ValueError: the message has the name and the value or the lengths.
    """
    lengths = {len(part) for part in (*parts, *filter(None, optional))}
    if len(lengths) > 1:
        raise ValueError(f"the parts of {name!r} have {sorted(lengths)} values; they must have equally many")
    for value in (each for part in (*parts, *optional) for each in part if isinstance(each, int | float)):
        if not isfinite(value):
            raise ValueError(f"{name!r} has the value {value}; a missing value must be None")


@dataclass(frozen=True)
class Axis:
    """One axis of a panel.

    Attributes:
        label: name with the unit; empty for none.
        limits: the ends of the axis, ascending.
        whole: put ticks at whole numbers only.
        log: logarithmic; the limits are above 0.
        ticks: values and the texts that replace their numbers.
    """

    label: str
    limits: tuple[float, float]
    whole: bool = False
    log: bool = False
    ticks: tuple[tuple[float, str], ...] = ()

    def __post_init__(self) -> None:
        check_numbers(self.label, (self.limits,))
        if len(self.limits) != 2 or not self.limits[0] < self.limits[1] or (self.log and self.limits[0] <= 0):
            wanted = "two numbers that ascend, from above 0 if it is logarithmic"
            raise ValueError(f"the limits of an axis must be {wanted}, not {self.limits}")


Numbers = tuple[Number, ...]
PLAIN = Style(INK, "solid", "circle")


@dataclass(frozen=True)
class Line:
    """A line through points, with a band around it where `lower` and `upper` have values.

    Attributes:
        name: entry in the legend; marks with the same name share it and its colour.
        hover: a text for each point, for the mouse pointer.
        markers: draw a marker at each point.
        faint: draw a thin line behind the others, like one repetition behind the mean.
    """

    name: str
    x: Numbers
    y: Numbers
    style: Style = PLAIN
    lower: Numbers = ()
    upper: Numbers = ()
    hover: tuple[str, ...] = ()
    markers: bool = True
    faint: bool = False

    def __post_init__(self) -> None:
        check_numbers(self.name, (self.x, self.y), (self.lower, self.upper, self.hover))


@dataclass(frozen=True)
class Points:
    """Points without a line.

    Attributes:
        shades: a number for each point, drawn from light to dark instead of the style's colour; a bar beside the
            figure explains them.
        shades_label: label of that bar.
        hover: a text for each point.
        size: factor of the markers' size.
        hollow: draw outlines only.
    """

    name: str
    x: Numbers
    y: Numbers
    style: Style = PLAIN
    shades: tuple[float, ...] = ()
    shades_label: str = ""
    hover: tuple[str, ...] = ()
    size: float = 1.0
    hollow: bool = False

    def __post_init__(self) -> None:
        check_numbers(self.name, (self.x, self.y), (self.shades, self.hover))


@dataclass(frozen=True)
class Polylines:
    """Lines through the same places on x, each in its own shade.

    Attributes:
        rows: y of each line at each place.
        shades: a number for each line, as for Points.
    """

    name: str
    x: Numbers
    rows: tuple[Numbers, ...]
    shades: tuple[float, ...]
    shades_label: str = ""
    hover: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_numbers(self.name, (self.x, *self.rows))
        check_numbers(self.name, (self.shades,), (self.rows, self.hover))


@dataclass(frozen=True)
class Level:
    """A reference value, drawn across the whole panel, with a band between `lower` and `upper`.

    Attributes:
        upright: the value is one of x, not of y.
        marked: draw the markers of its style along the line.
    """

    name: str
    value: float
    style: Style = PLAIN
    lower: Number = None
    upper: Number = None
    upright: bool = False
    marked: bool = False

    def __post_init__(self) -> None:
        check_numbers(self.name, ((self.value, self.lower, self.upper),))


@dataclass(frozen=True)
class Diagonal:
    """The line on which y equals x."""

    name: str
    style: Style = PLAIN


@dataclass(frozen=True)
class Bars:
    """Intervals of x, drawn as thick bars at values of y, as the contacts of feet in a footfall diagram.

    Attributes:
        intervals: `(begin, end, y)` of each bar.
        thickness: thickness in units of y.
    """

    name: str
    intervals: tuple[tuple[float, float, float], ...]
    style: Style = PLAIN
    thickness: float = 0.8

    def __post_init__(self) -> None:
        check_numbers(self.name, self.intervals)


@dataclass(frozen=True)
class Arrow:
    """An arrow from one point to another."""

    start: tuple[float, float]
    end: tuple[float, float]
    style: Style = PLAIN

    def __post_init__(self) -> None:
        check_numbers("arrow", (self.start, self.end))


@dataclass(frozen=True)
class Label:
    """A text above a point, or beside it."""

    text: str
    x: float
    y: float
    beside: bool = False

    def __post_init__(self) -> None:
        check_numbers(self.text, ((self.x, self.y),))


Mark = Line | Points | Polylines | Level | Diagonal | Bars | Arrow | Label


@dataclass(frozen=True)
class Panel:
    """Marks between two axes.

    Attributes:
        height: factor of the usual height.
        square: make the panel as high as wide.
    """

    marks: tuple[Mark, ...]
    x: Axis
    y: Axis
    title: str = ""
    height: float = 1.0
    square: bool = False


@dataclass(frozen=True)
class Table:
    """The numbers of a figure as text, for screen readers and for copying."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class FigureDefinition:
    """The content of a figure, in words and numbers.

    Attributes:
        name: kind of the figure, for file names.
        title: text above the figure; empty for none.
        panels: panels, row by row.
        columns: panels in a row.
        share_x: panels of a column share one horizontal axis, which is labelled beneath the last.
        caption: text that states at least the number of repetitions and the meaning of the bands.
        alt: a description in a sentence or two, for screen readers.
        table: its numbers as text.
        nothing: text that replaces the marks while there are none.
    """

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}  # in JSON, fields tell marks from each other

    name: str
    title: str
    panels: tuple[Panel, ...]
    caption: str
    alt: str
    columns: int = 1
    share_x: bool = False
    table: Table | None = None
    nothing: str = "no results yet"

    @property
    def empty(self) -> bool:
        """Whether there is nothing to draw yet."""
        return not any(_has_data(mark) for mark in self.marks)

    @property
    def marks(self) -> tuple[Mark, ...]:
        """The marks of all panels."""
        return tuple(mark for panel in self.panels for mark in panel.marks)

    @property
    def shaded(self) -> list[Points | Polylines]:
        """The marks that are drawn in shades."""
        return [mark for mark in self.marks if isinstance(mark, Points | Polylines) and mark.shades]

    @property
    def shade_limits(self) -> tuple[float, float]:
        """The numbers of the lightest and the darkest shade, which differ; 0 and 1 without any."""
        values = [shade for mark in self.shaded for shade in mark.shades] or [0.0]
        least, most = min(values), max(values)
        return least, most if most > least else least + 1

    def with_axis(self, which: str, **changes: Any) -> "FigureDefinition":  # noqa: ANN401 - fields of an axis
        """Return the figure with another `label` or other `limits` of its axis x or y.

        Raises:
            ValueError: the limits do not ascend, or the panels have different axes.
        """
        axes = [getattr(panel, which) for panel in self.panels]
        if changes and len(names := dict.fromkeys(axis.label for axis in axes)) > 1:
            raise ValueError(f"the panels have different axes ({'; '.join(names)}), so none is meant")
        changed = ({which: replace(axis, **changes)} for axis in axes)
        panels = zip(self.panels, changed, strict=True)
        return replace(self, panels=tuple(replace(panel, **axis) for panel, axis in panels))

    @property
    def row_heights(self) -> list[float]:
        """The height of each row of panels, as a factor: that of its highest panel."""
        starts = range(0, len(self.panels), self.columns)
        return [max(panel.height for panel in self.panels[start : start + self.columns]) for start in starts]


def faint_lines(name: str, x: Sequence[Number], rows: Sequence[Sequence[Number]], style: Style) -> Line:
    """Return a faint line through each row of y as a single mark, with gaps between the rows."""
    return Line(name, (*x, None) * len(rows), tuple(y for row in rows for y in (*row, None)), style, faint=True)


def _has_data(mark: Mark) -> bool:
    if isinstance(mark, Line | Points):
        return any(each is not None for each in mark.y)
    if isinstance(mark, Polylines):
        return any(each is not None for row in mark.rows for each in row)
    return isinstance(mark, Level | Arrow) or (isinstance(mark, Bars) and bool(mark.intervals))
