"""Figures as Plotly charts: plain data and layout for JSON, built without importing Plotly.

The layout has no template, no font, and no colours of paper, axes or grid: a page sets them, and can be light or dark.
A trace with `"meta": {"ink": true}` has the colour of text; the page replaces it by its own in the line, the marker and
the fill, whose opacity it keeps. The same holds for an annotation named `ink`.
"""

from math import log10
from typing import Any

from gaplab.services.figures.marks import Arrow, Axis, FigureDefinition, Label, Line, Panel, Points, Polylines
from gaplab.services.figures.plotly.trace_dicts import Trace, short, text, traces
from gaplab.services.figures.style import SHADES

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
        layout["coloraxis"] = _shades(figure.shaded)
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


def _shades(shaded: list[Points | Polylines]) -> dict[str, Any]:
    values = [each for points in shaded for each in points.shades]
    last = len(SHADES) - 1
    whole = all(each == int(each) for each in values)
    ticks = {"dtick": max(1, round((max(values) - min(values)) / 5))} if whole else {}
    return {
        "colorscale": [[round(at / last, 4), color] for at, color in enumerate(SHADES)],
        "cmin": min(values),
        "cmax": max(values) if max(values) > min(values) else min(values) + 1,
        "colorbar": {
            "title": {"text": text(shaded[0].shades_label), "side": "right"},
            "thickness": 10,
            "outlinewidth": 0,
            **ticks,
        },
    }


def _is_read_along_x(figure: FigureDefinition) -> bool:
    """Return whether one hover text can show the values of all lines at an x: without points, each line has one."""
    kinds = {type(mark) for mark in figure.marks}
    return Line in kinds and not kinds & {Points, Polylines}
