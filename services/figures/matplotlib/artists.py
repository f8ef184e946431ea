"""Marks as matplotlib's artists."""

from typing import TYPE_CHECKING, Any

from gaplab.services.figures.marks import (
    Arrow,
    Bars,
    Diagonal,
    Label,
    Level,
    Line,
    Mark,
    Number,
    Panel,
    Points,
    Polylines,
)
from gaplab.services.figures.matplotlib.page_layout import legend_name, printable
from gaplab.services.figures.style import INK, SHADES, Style
from gaplab.services.figures.words import evenly

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap

DASHES: dict[str, Any] = {
    "solid": "-",
    "dashed": (0, (4, 1.6)),
    "dotted": (0, (1, 1.4)),
    "dashdot": (0, (5, 1.4, 1, 1.4)),
    "long": (0, (8, 2)),
    "longdot": (0, (7, 1.4, 1, 1.4, 1, 1.4)),
}
MARKERS = {"circle": "o", "square": "s", "triangle": "^", "diamond": "D", "inverted": "v", "cross": "X", "star": "*"}

NAN = float("nan")


def draw_marks(panel: Panel, axes: "Axes", shades: tuple[float, float]) -> None:
    """Draw the marks of a panel into axes whose limits are set, the first lines above later ones.

    `shades` are the numbers of the lightest and the darkest shade.
    """
    for order, mark in enumerate(panel.marks):
        _draw(mark, axes, 10 - 0.01 * order, shades)


def _draw(mark: Mark, axes: "Axes", order: float, shades: tuple[float, float]) -> None:
    match mark:
        case Line():
            _line(mark, axes, order)
        case Points() | Polylines():
            _shaded(mark, axes, order, shades)
        case Level():
            _level(mark, axes)
        case Diagonal():
            axes.axline((0, 0), slope=1, **_thin(mark.name, mark.style))
        case Bars():
            _bars(mark, axes)
        case Arrow():
            look = {"arrowstyle": "-|>", "color": mark.style.color, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", xy=mark.end, xytext=mark.start, arrowprops=look, zorder=20)
        case Label():
            _label(mark, axes)


def _line(line: Line, axes: "Axes", order: float) -> None:
    look = line.style
    x, y = _floats(line.x), _floats(line.y)
    drawn: dict[str, Any] = {"color": look.color}
    if line.faint:
        axes.plot(x, y, **drawn, linewidth=0.4, alpha=0.3, zorder=1.5)
        return
    if line.markers:
        drawn |= {"marker": MARKERS[look.marker], "markersize": 3.6, "markeredgecolor": "white", "markeredgewidth": 0.4}
    width, name = (0.6, "_thin") if look.thin else (1.2, legend_name(line.name))
    drawn |= {"linestyle": DASHES[look.dash], "linewidth": width, "label": name, "zorder": order}
    axes.plot(x, y, **drawn)
    if any(each is not None for each in line.lower):
        lower, upper = _ends(line.lower, line.y), _ends(line.upper, line.y)
        axes.fill_between(x, lower, upper, color=look.color, alpha=0.13, linewidth=0, zorder=1)


def _shaded(mark: Points | Polylines, axes: "Axes", order: float, shades: tuple[float, float]) -> None:
    if isinstance(mark, Points):
        _points(mark, axes, order + 5, shades)
    else:
        _polylines(mark, axes, order, shades)


def _polylines(lines: Polylines, axes: "Axes", order: float, shades: tuple[float, float]) -> None:
    from matplotlib.collections import LineCollection

    drawn = LineCollection(
        [list(zip(_floats(lines.x), _floats(row), strict=True)) for row in lines.rows],
        array=list(lines.shades),
        cmap=_shades(),
        linewidths=0.7,
        alpha=0.75,
        zorder=order,
    )
    drawn.set_clim(*shades)
    axes.add_collection(drawn)


def _shades() -> "Colormap":
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("shades", SHADES)


def _points(points: Points, axes: "Axes", order: float, shades: tuple[float, float]) -> None:
    look = points.style
    drawn: dict[str, Any] = {"marker": MARKERS[look.marker], "s": 16 * points.size**2, "zorder": order}
    if points.shades:
        drawn |= {"c": points.shades, "cmap": _shades(), "vmin": shades[0], "vmax": shades[1]}
        drawn |= {"edgecolors": "white", "linewidths": 0.3}
    elif points.hollow:
        drawn |= {"facecolors": "none", "edgecolors": look.color, "linewidths": 0.9}
    else:
        drawn |= {"color": look.color, "edgecolors": "white", "linewidths": 0.3 * points.size}
    axes.scatter(_floats(points.x), _floats(points.y), label=legend_name(points.name), **drawn)


def _level(level: Level, axes: "Axes") -> None:
    line, area = (axes.axvline, axes.axvspan) if level.upright else (axes.axhline, axes.axhspan)
    if level.marked:
        places = evenly(*(axes.get_ylim() if level.upright else axes.get_xlim()))
        marker: dict[str, Any] = {"marker": MARKERS[level.style.marker], "markersize": 3.2, "markeredgewidth": 0}
        along = (places, [level.value] * len(places))
        axes.plot(*along[:: -1 if level.upright else 1], **_thin(level.name, level.style), **marker)
    else:
        line(level.value, **_thin(level.name, level.style))
    if level.lower is not None and level.upper is not None:
        alpha = 0.07 if level.style.ink else 0.13
        area(level.lower, level.upper, color=level.style.color, alpha=alpha, linewidth=0, zorder=1)


def _bars(bars: Bars, axes: "Axes") -> None:
    axes.barh(
        [y for _, _, y in bars.intervals],
        [end - begin for begin, end, _ in bars.intervals],
        left=[begin for begin, _, _ in bars.intervals],
        height=bars.thickness,
        color=bars.style.color,
        linewidth=0,
        label=legend_name(bars.name),
        zorder=3,
    )


def _label(label: Label, axes: "Axes") -> None:
    away = (4, 0) if label.beside else (0, 3)
    place: Any = {"ha": "left", "va": "center"} if label.beside else {"ha": "center", "va": "bottom"}
    place |= {"textcoords": "offset points", "color": INK, "zorder": 20}
    axes.annotate(printable(label.text), (label.x, label.y), away, **place)


def _thin(name: str, look: Style) -> dict[str, Any]:
    shown = {"color": look.color, "linestyle": DASHES[look.dash], "linewidth": 0.9}
    return shown | {"label": legend_name(name), "zorder": 2}


def _floats(values: tuple[Number, ...]) -> list[float]:
    return [NAN if each is None else each for each in values]


def _ends(ends: tuple[Number, ...], values: tuple[Number, ...]) -> list[float]:
    """Return the ends of a band, of width 0 where it has none."""
    return _floats(tuple(value if end is None else end for end, value in zip(ends, values, strict=True)))
