"""Marks as Plotly's traces."""

from collections.abc import Sequence
from html import escape
from itertools import pairwise, zip_longest
from typing import Any

from gaplab.services.figures.marks import Bars, Diagonal, Level, Line, Mark, Number, Panel, Points, Polylines
from gaplab.services.figures.style import SHADES, Style, shade_at, tint
from gaplab.services.figures.words import evenly

Trace = dict[str, Any]

DASHES = {"dashed": "dash", "dotted": "dot", "long": "longdash", "longdot": "longdashdot"}
MARKERS = {"triangle": "triangle-up", "inverted": "triangle-down", "cross": "x"}
"""Plotly's names of dashes and markers, where they differ from ours."""

SHADED = Style(SHADES[0], "solid", "circle")
"""The look of a mark whose colour is that of its shade."""

DIGITS = 6
"""Significant digits of a coordinate: more than a screen can show."""


def traces(panel: Panel) -> list[Trace]:
    """Return the traces of a panel: bands beneath lines, and the first lines above later ones.

    `legendrank` keeps the order of the marks in the legend.
    """
    found = [
        (layer, -order, trace | {"legendrank": order + 1})
        for order, mark in enumerate(panel.marks)
        for layer, trace in _layers(mark, panel)
    ]
    return [trace for _, _, trace in sorted(found, key=lambda each: each[:2])]


def _layers(mark: Mark, panel: Panel) -> list[tuple[int, Trace]]:
    """Return the traces of a mark with their layers; higher layers are drawn above."""
    match mark:
        case Line():
            return [*((0, each) for each in _band(mark)), (1 if mark.faint else 3, _line(mark))]
        case Points() | Polylines():
            return [(4, each) for each in (_points(mark) if isinstance(mark, Points) else _polylines(mark))]
        case Level():
            return _level(mark, panel)
        case Diagonal():
            return [(2, _across(mark.name, mark.style, panel.x.limits, panel.x.limits))]
        case Bars():
            return [(1, _bars(mark))]
        case _:
            return []


def text(words: str) -> str:
    """Escape a text for Plotly, which interprets some HTML."""
    return escape(words, quote=False)


def short(value: Number) -> Number:
    """Round a coordinate to the digits that a screen can show."""
    return value if value is None or isinstance(value, int) else float(f"{value:.{DIGITS}g}")


def _scatter(name: str, look: Style, x: Sequence[Number], y: Sequence[Number], mode: str) -> Trace:
    places = {"x": [short(each) for each in x], "y": [short(each) for each in y]}
    return _legend_of(name, look) | {"type": "scatter"} | places | {"mode": mode}


def _line(line: Line) -> Trace:
    look = line.style
    mode = "lines+markers" if line.markers and not line.faint else "lines"
    trace = _scatter(line.name, look, line.x, line.y, mode) | {
        "line": {"color": look.color, "dash": DASHES.get(look.dash, look.dash), "width": 2.25},
        "marker": {"color": look.color, "symbol": MARKERS.get(look.marker, look.marker), "size": 8},
    }
    if line.steps:
        trace["line"]["shape"] = "hv"
    if line.faint:
        trace["line"] |= {"width": 1, "dash": "solid"}
        return _quiet(trace) | {"opacity": 0.35}
    if look.thin:
        trace["line"] |= {"width": 1}
        trace["showlegend"] = False
    return trace | _hover(line.hover)


def _band(line: Line) -> list[Trace]:
    ends = [each for each in zip(line.x, line.lower, line.upper, strict=False) if None not in each]
    if not ends:
        return []
    if line.steps:
        held = [(later[0], *each[1:]) for each, later in pairwise(ends)]
        ends = [each for both in zip_longest(ends, held) for each in both if each is not None]
    around = [*(x for x, _, _ in ends), *(x for x, _, _ in reversed(ends))]
    return [_area(line.name, line.style, around, [*(y for _, _, y in ends), *(y for _, y, _ in reversed(ends))])]


def _points(points: Points) -> list[Trace]:
    look = points.style
    symbol = MARKERS.get(look.marker, look.marker)
    marker: Trace = {"color": look.color, "symbol": symbol, "size": round(7 * points.size, 1)}
    marker |= {"opacity": 0.8 if len(points.y) > 1 else 1}
    if points.hollow:
        marker |= {"symbol": f"{symbol}-open", "line": {"width": 1.5}, "opacity": 1}
    trace = _scatter(points.name, look, points.x, points.y, "markers") | {"marker": marker} | _hover(points.hover)
    if not points.shades:
        return [trace]
    shaded = marker | {"color": [short(each) for each in points.shades], "coloraxis": "coloraxis"}
    in_the_legend = trace | {"x": [None], "y": [None], "marker": marker | {"color": SHADES[len(SHADES) // 2]}}
    return [trace | {"marker": shaded, "showlegend": False}, in_the_legend]


def _polylines(lines: Polylines) -> list[Trace]:
    """Return a trace for the lines of each shade, and points without place that bring the bar of shades."""
    least, most = min(lines.shades, default=0.0), max(lines.shades, default=0.0)
    found = []
    for shade in sorted(set(lines.shades)):
        rows = [(at, row) for at, row in enumerate(lines.rows) if lines.shades[at] == shade]
        x = [place for _ in rows for place in (*lines.x, None)]
        y = [value for _, row in rows for value in (*row, None)]
        told = [text(lines.hover[at]) for at, row in rows for _ in (*row, None)] if lines.hover else []
        color = shade_at((shade - least) / ((most - least) or 1.0))
        trace = _scatter(lines.name, SHADED, x, y, "lines") | {"line": {"color": color, "width": 1.25}, "opacity": 0.75}
        hover = {"customdata": told, "hovertemplate": "%{customdata}<extra></extra>"} if told else {"hoverinfo": "skip"}
        found.append(trace | hover | {"showlegend": False})
    bar = {"color": [short(least), short(most)], "coloraxis": "coloraxis"}
    return [*found, _quiet(_scatter(lines.name, SHADED, [None, None], [None, None], "markers")) | {"marker": bar}]


def _level(level: Level, panel: Panel) -> list[tuple[int, Trace]]:
    least, most = (panel.y if level.upright else panel.x).limits
    turn = -1 if level.upright else 1  # an upright level has x and y exchanged
    places = evenly(least, most) if level.marked else (least, most)
    line = _across(level.name, level.style, *(places, (level.value,) * len(places))[::turn])
    if level.marked:
        symbol = MARKERS.get(level.style.marker, level.style.marker)
        line |= {"mode": "lines+markers", "marker": {"color": level.style.color, "symbol": symbol, "size": 7}}
    found = [(2, line)]
    if level.lower is not None and level.upper is not None:
        corners = (least, most, most, least), (level.upper, level.upper, level.lower, level.lower)
        found.append((0, _area(level.name, level.style, *corners[::turn])))
    return found


def _across(name: str, look: Style, x: Sequence[float], y: Sequence[float]) -> Trace:
    line = {"color": look.color, "dash": DASHES.get(look.dash, look.dash), "width": 1.5}
    return _scatter(name, look, x, y, "lines") | {"line": line, "hoverinfo": "skip"}


def _area(name: str, look: Style, x: Sequence[Number], y: Sequence[Number]) -> Trace:
    fill = {"fill": "toself", "fillcolor": tint(look.color, 0.07 if look.ink else 0.13)}
    line = {"line": {"color": look.color, "width": 0}}
    return _quiet(_legend_of(name, look)) | _scatter(name, look, x, y, "lines") | line | fill


def _bars(bars: Bars) -> Trace:
    return _legend_of(bars.name, bars.style) | {
        "type": "bar",
        "orientation": "h",
        "base": [short(begin) for begin, _, _ in bars.intervals],
        "x": [short(end - begin) for begin, end, _ in bars.intervals],
        "y": [short(y) for _, _, y in bars.intervals],
        "width": bars.thickness,
        "marker": {"color": bars.style.color},
        "hovertemplate": "%{base:.4g} to %{x:.4g}",
    }


def _legend_of(name: str, look: Style) -> Trace:
    shown = {"name": text(name), "legendgroup": text(name)} if name else {"name": ""}
    return shown | ({"meta": {"ink": True}} if look.ink else {})


def _quiet(trace: Trace) -> Trace:
    return trace | {"showlegend": False, "hoverinfo": "skip"}


def _hover(words: tuple[str, ...]) -> Trace:
    return {"customdata": [text(each) for each in words], "hovertemplate": "%{customdata}"} if words else {}
