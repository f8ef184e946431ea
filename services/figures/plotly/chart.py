"""Figures as Plotly charts: plain data and layout for JSON, built without importing Plotly.

The layout has no template, no font, and no colours of paper, axes or grid: a page sets them, and can be light or dark.
A trace with `"meta": {"ink": true}` has the colour of text; the page replaces it by its own in the line, the marker and
the fill, whose opacity it keeps. The same holds for an annotation named `ink`.
"""

from collections.abc import Sequence
from html import escape
from math import log10
from typing import Any

from gaplab.services.figures.marks import (
    Arrow,
    Axis,
    Bars,
    Diagonal,
    FigureDefinition,
    Label,
    Level,
    Line,
    Mark,
    Number,
    Panel,
    Points,
    Polylines,
)
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

ROW_PX, LOW_ROW_PX = 300, 190
"""Height of the only row of panels, and of one of several rows."""

SQUARE_PX = {1: 380, 2: 300, 3: 240}
"""Height of square panels, by the number of panels in a row."""

AROUND_PX = 120
"""Height of labels, legend and margins together."""


def chart(figure: FigureDefinition) -> dict[str, Any]:
    """Return the figure as `{"data": […], "layout": {…}}`, the arguments of `Plotly.newPlot`."""
    data: list[Trace] = []
    named: set[str] = set()
    for index, panel in enumerate(figure.panels):
        suffix = _suffix(index)
        data += [
            trace | _legend(trace, named) | {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"} for trace in traces(panel)
        ]
    return {"data": data, "layout": _layout(figure) | {"showlegend": bool(named)}}


def _legend(trace: Trace, named: set[str]) -> Trace:
    """Show each name in the legend once; its entry toggles all marks of that name."""
    name = trace["name"]
    shown = bool(name) and name not in named and trace.get("showlegend", True)
    if shown:
        named.add(name)
    return {"showlegend": shown}


def _suffix(index: int) -> str:
    return "" if index == 0 else str(index + 1)


def _layout(figure: FigureDefinition) -> dict[str, Any]:
    titled = any(panel.title for panel in figure.panels)
    layout: dict[str, Any] = {
        "height": _height(figure),
        "hovermode": "x unified" if _is_read_along_x(figure) else "closest",
        "barmode": "overlay",
        "legend": {"orientation": "h", "x": 0, "yref": "container", "y": 0, "yanchor": "bottom"},
        "margin": {"l": 8, "r": 12, "t": 32 if titled else 12, "b": 8},
        "annotations": [],
    }
    for index, panel in enumerate(figure.panels):
        layout |= _axes(figure, index)
        layout["annotations"] += _annotations(panel, _suffix(index))
    if figure.shaded:
        layout["coloraxis"] = _shades(figure)
    if figure.empty:
        layout["annotations"].append(
            _annotation(figure.nothing) | {"xref": "paper", "yref": "paper", "x": 0.5, "y": 0.5}
        )
    return layout


def _height(figure: FigureDefinition) -> int:
    rows = figure.row_heights
    usual = ROW_PX if len(rows) == 1 else LOW_ROW_PX
    row_px = SQUARE_PX.get(figure.columns, LOW_ROW_PX) if figure.panels[0].square else usual
    return round(row_px * sum(rows)) + AROUND_PX


def _axes(figure: FigureDefinition, index: int) -> dict[str, Any]:
    panel, suffix = figure.panels[index], _suffix(index)
    row, column = divmod(index, figure.columns)
    x = _axis(panel.x) | {"domain": _part([1.0] * figure.columns, column, 0.14), "anchor": f"y{suffix}"}
    gap = 0.08 if figure.share_x else 0.2
    low, high = _part(figure.row_heights, row, gap)
    y = _axis(panel.y) | {"domain": [round(1 - high, 4), round(1 - low, 4)], "anchor": f"x{suffix}"}
    if panel.square:
        x["constrain"] = "domain"
        y |= {"constrain": "domain", "scaleanchor": f"x{suffix}", "scaleratio": _span(panel.x) / _span(panel.y)}
    if figure.share_x and row:
        x["matches"] = f"x{_suffix(column)}"
    if figure.share_x and index + figure.columns < len(figure.panels):
        x |= {"showticklabels": False, "title": {"text": ""}}
    return {f"xaxis{suffix}": x, f"yaxis{suffix}": y}


def _axis(axis: Axis) -> dict[str, Any]:
    found: dict[str, Any] = {
        "title": {"text": text(axis.label)},
        "range": [short(log10(each) if axis.log else each) for each in axis.limits],
        "zeroline": False,
        "automargin": True,
    }
    if axis.whole:
        found["dtick"] = max(1, round((axis.limits[1] - axis.limits[0]) / 10))
    if axis.log:
        decades = found["range"][1] - found["range"][0]
        found |= {"type": "log", "dtick": max(1, round(decades / 5)), "exponentformat": "power"}
    if axis.ticks:
        found |= {"tickvals": [at for at, _ in axis.ticks], "ticktext": [text(words) for _, words in axis.ticks]}
    return found


def _span(axis: Axis) -> float:
    return axis.limits[1] - axis.limits[0]


def _part(sizes: list[float], index: int, gap: float) -> list[float]:
    """Return the ends of one part when 0 to 1 is divided into parts of these sizes, with gaps between them."""
    unit = (1 - gap * (len(sizes) - 1)) / sum(sizes)
    start = sum(sizes[:index]) * unit + gap * index
    return [round(start, 4), round(start + sizes[index] * unit, 4)]


def _annotations(panel: Panel, suffix: str) -> list[dict[str, Any]]:
    own = {"xref": f"x{suffix}", "yref": f"y{suffix}"}
    found = []
    for mark in panel.marks:
        if isinstance(mark, Label):
            place = {"xanchor": "left", "xshift": 6} if mark.beside else {"yanchor": "bottom", "yshift": 4}
            found.append(_annotation(mark.text) | own | {"x": short(mark.x), "y": short(mark.y)} | place)
        if isinstance(mark, Arrow):
            found.append(_arrow(mark) | own | {"axref": f"x{suffix}", "ayref": f"y{suffix}"})
    if panel.title:
        at = {"xref": f"x{suffix} domain", "yref": f"y{suffix} domain", "x": 0, "y": 1}
        found.append(_annotation(panel.title) | at | {"xanchor": "left", "yanchor": "bottom", "yshift": 4})
    return found


def _annotation(words: str) -> dict[str, Any]:
    return {"text": text(words), "showarrow": False}


def _arrow(arrow: Arrow) -> dict[str, Any]:
    (ax, ay), (x, y) = arrow.start, arrow.end
    ends = {"ax": short(ax), "ay": short(ay), "x": short(x), "y": short(y)}
    look = {"arrowhead": 2, "arrowwidth": 1.75, "arrowcolor": arrow.style.color}
    return {"text": "", "showarrow": True} | ends | look | ({"name": "ink"} if arrow.style.ink else {})


def _shades(figure: FigureDefinition) -> dict[str, Any]:
    (least, most), last = figure.shade_limits, len(SHADES) - 1
    whole = all(each == int(each) for mark in figure.shaded for each in mark.shades)
    ticks = {"dtick": max(1, round((most - least) / 5))} if whole else {}
    return {
        "colorscale": [[round(at / last, 4), color] for at, color in enumerate(SHADES)],
        "cmin": least,
        "cmax": most,
        "colorbar": {
            "title": {"text": text(figure.shaded[0].shades_label), "side": "right"},
            "thickness": 10,
            "outlinewidth": 0,
            **ticks,
        },
    }


def _is_read_along_x(figure: FigureDefinition) -> bool:
    """Return whether one hover text can show the values of all lines at an x: without points, each line has one."""
    kinds = {type(mark) for mark in figure.marks}
    return Line in kinds and not kinds & {Points, Polylines}


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
    """Return a trace for the lines of each shade, and an empty trace that shows the colour bar."""
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
