"""Parallel coordinates: one axis for each setting and result, and one line for each simulator or experiment."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log10

from gaplab.services.figures.marks import (
    Axis,
    FigureDefinition,
    Label,
    Line,
    Mark,
    Number,
    Panel,
    Polylines,
    Table,
)
from gaplab.services.figures.words import drawable, heading, is_wide, number, number_of, power, printable

MOST = 1_000
"""Most lines; beyond them, only the first are drawn."""

LONGEST = 22
"""Characters of a label of an axis."""


@dataclass(frozen=True)
class Coordinate:
    """One axis.

    Attributes:
        label: name with the unit.
        values: the value of each line: numbers, or words for a setting that is not a number; None if it has none.
        lower: value at the bottom; None for the least value.
        upper: value at the top; None for the greatest value.
        wide: logarithmic, if the values need it.
    """

    label: str
    values: tuple[float | str | None, ...]
    lower: Number = None
    upper: Number = None
    wide: bool = False


@dataclass(frozen=True)
class _Scaled:
    """A coordinate between 0 and 1: the height of each line, and the labels of the axis by height.

    Labels are numbers at the ends of the axis, or words beside their heights.
    """

    heights: tuple[Number, ...]
    ticks: tuple[tuple[float, str], ...]
    words: bool = False


def coordinates_figure(
    coordinates: Sequence[Coordinate],
    *,
    shades: Sequence[float],
    shades_label: str,
    hover: Sequence[str],
    what: str,
    title: str = "",
) -> FigureDefinition:
    """Return parallel coordinates: each line joins the values of one simulator or experiment, `what` in a word.

    The axes have one value for each line; lines are drawn from light to dark by their shades.
    """
    coordinates, lines = list(coordinates), len(shades)
    scaled = [_scaled(coordinate) for coordinate in coordinates]
    shown = min(lines, MOST)
    rows = tuple(tuple(axis.heights[line] for axis in scaled) for line in range(shown))
    places = tuple(float(place) for place in range(len(coordinates)))
    marks: list[Mark] = [Polylines("", places, rows, tuple(shades[:shown]), shades_label, tuple(hover[:shown]))]
    ends = [(place, end) for place in places for end in (0.0, 1.0, None)]
    marks.append(Line("", tuple(p for p, _ in ends), tuple(end for _, end in ends), markers=False))
    marks += [
        Label(text, place, height, beside=axis.words)
        for place, axis in zip(places, scaled, strict=True)
        for height, text in axis.ticks
    ]
    ticks = tuple((place, printable(axis.label, LONGEST)) for place, axis in zip(places, coordinates, strict=True))
    frame = Axis("", (-0.4, max(1.0, len(coordinates) - 1) + 0.6), ticks=ticks)
    return FigureDefinition(
        name="coordinates",
        title=heading(title),
        panels=(Panel(tuple(marks) if shown else (), frame, Axis("", (-0.19, 1.16), ticks=((0.0, ""), (1.0, "")))),),
        caption=_caption(what, lines, shown, shades_label),
        alt=_alt(coordinates, what, lines),
        table=_table(coordinates, shown),
    )


def _scaled(coordinate: Coordinate) -> _Scaled:
    values = coordinate.values
    if any(isinstance(value, str) for value in values):
        return _of_words([None if value is None else str(value) for value in values])
    numbers = [None if value is None else drawable(float(value)) for value in values]
    there = [value for value in numbers if value is not None]
    if not there:
        return _Scaled((None,) * len(values), ())
    least = min(there) if coordinate.lower is None else coordinate.lower
    most = max(there) if coordinate.upper is None else coordinate.upper
    if coordinate.wide and is_wide((least, most)):
        heights = [None if value is None else log10(value / least) / log10(most / least) for value in numbers]
        return _Scaled(tuple(heights), ((-0.17, power(float(f"{least:.1g}"))), (1.0, power(float(f"{most:.1g}")))))
    span = most - least
    heights = [None if value is None else (value - least) / span if span else 0.5 for value in numbers]
    if not span:
        return _Scaled(tuple(heights), ((0.5, number(least)),))
    return _Scaled(tuple(heights), ((-0.17, number(least)), (1.0, number(most))))


def _of_words(values: Sequence[str | None]) -> _Scaled:
    """Place the distinct words at equal distances, in the order of their first line."""
    words = list(dict.fromkeys(value for value in values if value is not None))
    height = {word: 0.5 if len(words) == 1 else at / (len(words) - 1) for at, word in enumerate(words)}
    heights = tuple(None if value is None else height[value] for value in values)
    return _Scaled(heights, tuple((height[word], printable(word, LONGEST)) for word in words), words=True)


def _caption(what: str, lines: int, shown: int, shades_label: str) -> str:
    if not lines:
        return ""
    of = f" of {lines}" if lines > shown else ""
    shade = f"{shades_label[:1].lower()}{shades_label[1:]}"
    return f"One line for each of {number_of(what, shown)}{of}. Shade: {shade}."


def _alt(coordinates: Sequence[Coordinate], what: str, lines: int) -> str:
    if not lines:
        return "Parallel coordinates: no results yet."
    axes = ", ".join(coordinate.label for coordinate in coordinates)
    return f"Parallel coordinates of {number_of(what, lines)}, with the axes {axes}."


def _table(coordinates: Sequence[Coordinate], shown: int) -> Table:
    head = tuple(coordinate.label for coordinate in coordinates)
    cells = [[each if isinstance(each, str) else number(each) for each in axis.values[:shown]] for axis in coordinates]
    return Table(head, tuple(zip(*cells, strict=True)))
