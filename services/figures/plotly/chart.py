"""Figures as Plotly charts: data and layout as JSON has them, without Plotly itself.

The layout has no template, no font, and no colour of paper, axes or grid: whoever shows it sets those, and can be light
or dark. A trace whose `meta` is `{"ink": true}` is drawn in the colour of text and wants the page's own: in its line,
its marker and, with the opacity that it has, its fill. So does an annotation whose `name` is `ink`. `layout.height`
suits the figure.
"""

from math import log10
from typing import Any

from gaplab.services.figures.marks import Arrow, Axis, Figure, Label, Line, Panel, Points
from gaplab.services.figures.plotly.trace_dicts import Trace, short, text, traces
from gaplab.services.figures.style import SHADES

ROW_PX, LOW_ROW_PX = 300, 190
"""Height of a row of panels, where there is one and where there are several."""

SQUARE_PX = {1: 380, 2: 300, 3: 240}
"""Height of square panels, by how many stand in a row."""

AROUND_PX = 120
"""For labels, legend and margins."""


def chart(figure: Figure) -> dict[str, Any]:
    """The figure as `{"data": […], "layout": {…}}`, which is what `Plotly.newPlot` takes."""
    data: list[Trace] = []
    named: set[str] = set()
    for index, panel in enumerate(figure.panels):
        suffix = _suffix(index)
        data += [
            trace | _legend(trace, named) | {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"} for trace in traces(panel)
        ]
    return {"data": data, "layout": _layout(figure) | {"showlegend": bool(named)}}


def _legend(trace: Trace, named: set[str]) -> Trace:
    """Marks of one name are switched on and off together, and stand in the legend once."""
    name = trace["name"]
    shown = bool(name) and name not in named and trace.get("showlegend", True)
    if shown:
        named.add(name)
    return {"showlegend": shown}


def _suffix(index: int) -> str:
    return "" if index == 0 else str(index + 1)


def _layout(figure: Figure) -> dict[str, Any]:
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
    shaded = [mark for panel in figure.panels for mark in panel.marks if isinstance(mark, Points) and mark.shades]
    if shaded:
        layout["coloraxis"] = _shades(shaded)
    if figure.empty:
        layout["annotations"].append(
            _annotation(figure.nothing) | {"xref": "paper", "yref": "paper", "x": 0.5, "y": 0.5}
        )
    return layout


def _height(figure: Figure) -> int:
    rows = _rows(figure)
    each = (
        SQUARE_PX.get(figure.columns, LOW_ROW_PX)
        if figure.panels[0].square
        else ROW_PX
        if len(rows) == 1
        else LOW_ROW_PX
    )
    return round(each * sum(rows)) + AROUND_PX


def _rows(figure: Figure) -> list[float]:
    """The height of each row: of its highest panel."""
    starts = range(0, len(figure.panels), figure.columns)
    return [max(panel.height for panel in figure.panels[start : start + figure.columns]) for start in starts]


def _axes(figure: Figure, index: int) -> dict[str, Any]:
    panel, suffix = figure.panels[index], _suffix(index)
    row, column = divmod(index, figure.columns)
    x = _axis(panel.x) | {"domain": _part([1.0] * figure.columns, column, 0.14), "anchor": f"y{suffix}"}
    gap = 0.08 if figure.share_x else 0.2
    low, high = _part(_rows(figure), row, gap)
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
    """The ends of a part of 0 to 1 that is shared out in these sizes, with gaps between."""
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


def _shades(shaded: list[Points]) -> dict[str, Any]:
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


def _is_read_along_x(figure: Figure) -> bool:
    """Whether a value of x has one value of each line, to be shown all at once."""
    marks = [mark for panel in figure.panels for mark in panel.marks]
    return any(isinstance(each, Line) for each in marks) and not any(isinstance(each, Points) for each in marks)
