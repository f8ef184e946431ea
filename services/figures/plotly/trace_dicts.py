"""Marks as Plotly's traces."""

from collections.abc import Sequence
from html import escape
from itertools import pairwise, zip_longest
from typing import Any

from gaplab.services.figures.marks import Axis, Bars, Diagonal, Level, Line, Mark, Number, Panel, Points
from gaplab.services.figures.style import SHADES, Style, tint

Trace = dict[str, Any]

DASHES = {
    "solid": "solid",
    "dashed": "dash",
    "dotted": "dot",
    "dashdot": "dashdot",
    "long": "longdash",
    "longdot": "longdashdot",
}
MARKERS = {
    "circle": "circle",
    "square": "square",
    "triangle": "triangle-up",
    "diamond": "diamond",
    "inverted": "triangle-down",
    "cross": "x",
    "star": "star",
}

DIGITS = 6
"""Of a coordinate: more than any screen has."""


def traces(panel: Panel) -> list[Trace]:
    """The traces of a panel, bands beneath lines and the first lines above later ones.

    Those with a name may stand in the legend, by their rank.
    """
    found = [
        (layer, -order, trace | {"legendrank": order + 1})
        for order, mark in enumerate(panel.marks)
        for layer, trace in _layers(mark, panel)
    ]
    return [trace for _, _, trace in sorted(found, key=lambda each: each[:2])]


def _layers(mark: Mark, panel: Panel) -> list[tuple[int, Trace]]:
    """The traces of a mark, and how far above others they lie."""
    if isinstance(mark, Line):
        return [*((0, each) for each in _band(mark)), (1 if mark.faint else 3, _line(mark))]
    if isinstance(mark, Points):
        return [(4, each) for each in _points(mark)]
    if isinstance(mark, Level):
        return _level(mark, panel)
    if isinstance(mark, Diagonal):
        return [(2, _across(mark.name, mark.style, panel.x.limits, panel.x.limits))]
    return [(1, _bars(mark))] if isinstance(mark, Bars) else []


def text(words: str) -> str:
    """As Plotly shows it: it takes a part of HTML for itself."""
    return escape(words, quote=False)


def short(value: Number) -> Number:
    """The number without digits that nobody sees."""
    return None if value is None else value if isinstance(value, int) else float(f"{value:.{DIGITS}g}")


def _line(line: Line) -> Trace:
    look = line.style
    trace = _named(line.name, look) | {
        "type": "scatter",
        "x": [short(each) for each in line.x],
        "y": [short(each) for each in line.y],
        "mode": "lines+markers" if line.markers and not line.faint else "lines",
        "line": {"color": look.color, "dash": DASHES[look.dash], "width": 2.25},
        "marker": {"color": look.color, "symbol": MARKERS[look.marker], "size": 8},
    }
    if line.steps:
        trace["line"]["shape"] = "hv"
    if line.faint:
        trace["line"] |= {"width": 1, "dash": "solid"}
        return _quiet(trace) | {"opacity": 0.35}
    return trace | _hover(line.hover, "%{customdata}")


def _band(line: Line) -> list[Trace]:
    ends = [each for each in zip(line.x, line.lower, line.upper, strict=False) if None not in each]
    if not ends:
        return []
    if line.steps:
        held = [(later[0], *each[1:]) for each, later in pairwise(ends)]
        ends = [each for both in zip_longest(ends, held) for each in both if each is not None]
    around = [*(each[0] for each in ends), *(each[0] for each in reversed(ends))]
    return [_area(line.name, line.style, around, [*(each[2] for each in ends), *(each[1] for each in reversed(ends))])]


def _points(points: Points) -> list[Trace]:
    look = points.style
    marker: Trace = {"color": look.color, "symbol": MARKERS[look.marker], "size": round(7 * points.size, 1)}
    marker |= {"opacity": 0.8 if len(points.y) > 1 else 1}
    if points.hollow:
        marker |= {"symbol": f"{MARKERS[look.marker]}-open", "line": {"width": 1.5}, "opacity": 1}
    trace = (
        _named(points.name, look)
        | {
            "type": "scatter",
            "x": [short(each) for each in points.x],
            "y": [short(each) for each in points.y],
            "mode": "markers",
            "marker": marker,
        }
        | _hover(points.hover, "%{customdata}")
    )
    if not points.shades:
        return [trace]
    shaded = marker | {"color": [short(each) for each in points.shades], "coloraxis": "coloraxis"}
    in_the_legend = trace | {"x": [None], "y": [None], "marker": marker | {"color": SHADES[len(SHADES) // 2]}}
    return [trace | {"marker": shaded, "showlegend": False}, in_the_legend]


def _level(level: Level, panel: Panel) -> list[tuple[int, Trace]]:
    def placed(along: Sequence[float], value: Sequence[float]) -> tuple[Sequence[float], Sequence[float]]:
        return (value, along) if level.upright else (along, value)

    axis: Axis = panel.y if level.upright else panel.x
    least, most = axis.limits
    found = [(2, _across(level.name, level.style, *placed((least, most), (level.value, level.value))))]
    if level.lower is not None and level.upper is not None:
        ends = (level.upper, level.upper, level.lower, level.lower)
        found.append((0, _area(level.name, level.style, *placed((least, most, most, least), ends))))
    return found


def _across(name: str, look: Style, x: Sequence[float], y: Sequence[float]) -> Trace:
    return _named(name, look) | {
        "type": "scatter",
        "x": [short(each) for each in x],
        "y": [short(each) for each in y],
        "mode": "lines",
        "line": {"color": look.color, "dash": DASHES[look.dash], "width": 1.5},
        "hoverinfo": "skip",
    }


def _area(name: str, look: Style, x: Sequence[Number], y: Sequence[Number]) -> Trace:
    return _quiet(_named(name, look)) | {
        "type": "scatter",
        "x": [short(each) for each in x],
        "y": [short(each) for each in y],
        "mode": "lines",
        "line": {"color": look.color, "width": 0},
        "fill": "toself",
        "fillcolor": tint(look.color, 0.07 if look.ink else 0.13),
    }


def _bars(bars: Bars) -> Trace:
    return (
        _named(bars.name, bars.style)
        | {
            "type": "bar",
            "orientation": "h",
            "base": [short(begin) for begin, _, _ in bars.intervals],
            "x": [short(end - begin) for begin, end, _ in bars.intervals],
            "y": [short(y) for _, _, y in bars.intervals],
            "width": bars.thickness,
            "marker": {"color": bars.style.color},
        }
        | _hover((), "%{base:.4g} to %{x:.4g}")
    )


def _named(name: str, look: Style) -> Trace:
    shown = {"name": text(name), "legendgroup": text(name)} if name else {"name": ""}
    return shown | ({"meta": {"ink": True}} if look.ink else {})


def _quiet(trace: Trace) -> Trace:
    """The trace without a place in the legend, and silent when one points at it."""
    return trace | {"showlegend": False, "hoverinfo": "skip"}


def _hover(words: tuple[str, ...], template: str) -> Trace:
    if words:
        return {"customdata": [text(each) for each in words], "hovertemplate": template}
    return {} if template == "%{customdata}" else {"hovertemplate": template}
