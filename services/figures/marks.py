"""What figures are made of. None of it knows how it is drawn.

A value that is None is not there: it interrupts a line, and is left out among points. No number is nan or infinite.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from math import isfinite

from gaplab.services.figures.style import INK, Style

Number = float | None
Numbers = tuple[Number, ...]

PLAIN = Style(INK, "solid", "circle")


@dataclass(frozen=True)
class Line:
    """A line through points, with a band around it if `lower` and `upper` have values.

    Attributes:
        name: in the legend; marks of one name are of one colour, and stand there once.
        hover: a text for each point, for whoever points at it.
        markers: whether its points are marked.
        faint: it stands behind others, as one repetition behind the mean of all.
        steps: the value holds until the next point, rather than changing in between.
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
    steps: bool = False

    def __post_init__(self) -> None:
        _check(self.name, (self.x, self.y), (self.lower, self.upper, self.hover))


@dataclass(frozen=True)
class Points:
    """Points that nothing connects.

    Attributes:
        shades: a number for each, drawn from light to dark in place of the style's colour; a bar beside the figure
            says which is which, under `shades_label`.
        hover: a text for each.
        size: of their markers, as a factor.
        hollow: only their outlines are drawn.
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
        _check(self.name, (self.x, self.y), (self.shades, self.hover))


@dataclass(frozen=True)
class Level:
    """A value to compare with, drawn across the whole panel, with a band if it has ends.

    Attributes:
        upright: a value of x, not of y.
    """

    name: str
    value: float
    style: Style = PLAIN
    lower: Number = None
    upper: Number = None
    upright: bool = False

    def __post_init__(self) -> None:
        _check(self.name, ((self.value, self.lower, self.upper),), ())


@dataclass(frozen=True)
class Diagonal:
    """The line on which y equals x."""

    name: str
    style: Style = PLAIN


@dataclass(frozen=True)
class Bars:
    """Intervals of x as thick bars at values of y, as a foot's contacts in a footfall diagram.

    Attributes:
        intervals: `(begin, end, y)` of each.
        thickness: in units of y.
    """

    name: str
    intervals: tuple[tuple[float, float, float], ...]
    style: Style = PLAIN
    thickness: float = 0.8

    def __post_init__(self) -> None:
        _check(self.name, self.intervals, ())


@dataclass(frozen=True)
class Arrow:
    """From one point to another."""

    start: tuple[float, float]
    end: tuple[float, float]
    style: Style = PLAIN

    def __post_init__(self) -> None:
        _check("arrow", (self.start, self.end), ())


@dataclass(frozen=True)
class Label:
    """A text at a point, above it or beside it."""

    text: str
    x: float
    y: float
    beside: bool = False

    def __post_init__(self) -> None:
        _check(self.text, ((self.x, self.y),), ())


Mark = Line | Points | Level | Diagonal | Bars | Arrow | Label


@dataclass(frozen=True)
class Axis:
    """One axis of a panel.

    Attributes:
        label: with the unit; nothing if empty.
        limits: the ends of what is shown.
        whole: only whole numbers have ticks.
        log: logarithmic; its limits are above 0.
        ticks: values that are written as these texts, in place of numbers.
    """

    label: str
    limits: tuple[float, float]
    whole: bool = False
    log: bool = False
    ticks: tuple[tuple[float, str], ...] = ()

    def __post_init__(self) -> None:
        _check(self.label, (self.limits,), ())
        if not self.limits[0] < self.limits[1] or (self.log and self.limits[0] <= 0):
            msg = f"the limits of an axis go up, and those of a logarithmic one from above 0, not {self.limits}"
            raise ValueError(msg)


@dataclass(frozen=True)
class Panel:
    """Marks between two axes.

    Attributes:
        height: in units of the height of the figure's other panels.
        square: it is as high as it is wide.
    """

    marks: tuple[Mark, ...]
    x: Axis
    y: Axis
    title: str = ""
    height: float = 1.0
    square: bool = False


@dataclass(frozen=True)
class Table:
    """The figure's numbers in words: for a screen reader, and for whoever wants to copy one."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Figure:
    """Everything that is drawn, in words and numbers.

    Attributes:
        name: of its kind, for files.
        title: above it; nothing if empty.
        panels: row by row.
        columns: panels in a row.
        share_x: panels of a column have one horizontal axis, which is labelled beneath the last.
        caption: how many repetitions there are, what the bands are, and whatever else a caption must say.
        alt: what it shows, in a sentence or two, for a screen reader.
        nothing: what is said in place of marks as long as there are none.
    """

    name: str
    title: str
    panels: tuple[Panel, ...]
    caption: str
    alt: str
    columns: int = 1
    share_x: bool = False
    table: Table | None = None
    nothing: str = field(default="no results yet")

    @property
    def empty(self) -> bool:
        """Whether there is nothing to draw yet."""
        return not any(_has_data(mark) for panel in self.panels for mark in panel.marks)


def _has_data(mark: Mark) -> bool:
    if isinstance(mark, Line | Points):
        return any(each is not None for each in mark.y)
    return isinstance(mark, Level | Arrow) or (isinstance(mark, Bars) and bool(mark.intervals))


def _check(name: str, full: Sequence[Sequence[Number]], optional: Sequence[Sequence[object]]) -> None:
    """Refuse numbers that JSON does not have, and parts of different lengths.

    Raises:
        ValueError: one of them.
    """
    lengths = {len(each) for each in (*full, *filter(None, optional))}
    if len(lengths) > 1:
        msg = f"the parts of {name!r} have {sorted(lengths)} values, and should have equally many"
        raise ValueError(msg)
    wrong = [each for each in _numbers((*full, *optional)) if not isfinite(each)]
    if wrong:
        msg = f"{name!r} has the value {wrong[0]}; what is not there is None"
        raise ValueError(msg)


def _numbers(parts: Iterable[Sequence[object]]) -> Iterator[float]:
    return (each for part in parts for each in part if isinstance(each, int | float))
