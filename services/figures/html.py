"""Figures as one HTML file that needs nothing else: Plotly's own JavaScript, from its Python package, is inside."""

from html import escape
from typing import TYPE_CHECKING

from services.figures.definition import Baseline, Figure, Point, Series
from services.figures.style import INK, tint

if TYPE_CHECKING:
    from plotly.graph_objects import Figure as Chart
    from plotly.graph_objects import Scatter

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
}
FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Noto Sans', sans-serif"

PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light">
<title>{title}</title>
<style>
  body {{ font: 15px/1.5 {font}; color: {ink}; background: #fff; margin: 0 auto; padding: 1.5rem; max-width: 64rem; }}
  h1 {{ font-size: 1.25rem; margin: 0 0 .5rem; overflow-wrap: anywhere; }}
  figure {{ margin: 0; }}
  figcaption {{ color: #555; font-size: .875rem; max-width: 60em; }}
  details {{ margin-top: 1.5rem; overflow-x: auto; }}
  summary {{ cursor: pointer; }}
  table {{ border-collapse: collapse; font-size: .8125rem; font-variant-numeric: tabular-nums; margin-top: .75rem; }}
  th, td {{ padding: .25rem .75rem; text-align: right; border-bottom: 1px solid #e6e6e6; white-space: nowrap; }}
  th:first-child {{ text-align: left; }}
</style>
</head>
<body>
<h1>{title}</h1>
<figure>
{chart}
<figcaption>{note}</figcaption>
</figure>
<details><summary>The numbers: mean ± standard deviation (n)</summary>
{table}
</details>
</body>
</html>
"""


def render_html(figure: Figure) -> str:
    """The figure as a page, with its numbers in a table beneath; nothing in it asks the network for anything."""
    chart = plotly_chart(figure).to_html(
        include_plotlyjs=True,
        full_html=False,
        div_id="curves",
        default_height="36rem",
        config={
            "responsive": True,
            "displaylogo": False,
            # "Share chart" would send the numbers to a company's server: nothing of a figure is ever sent away
            "modeBarButtonsToRemove": ["sendChartToCloud", "lasso2d", "select2d", "autoScale2d"],
            "toImageButtonOptions": {"format": "svg", "filename": "gaplab-curves"},
        },
    )
    title = escape(figure.title) or "Curves"
    return PAGE.format(title=title, chart=chart, note=escape(figure.note), table=_table(figure), font=FONT, ink=INK)


def plotly_chart(figure: Figure) -> "Chart":
    """The figure as Plotly's own object, for a notebook."""
    from plotly.graph_objects import Figure as Chart

    bands = [_band(each) for each in figure.series]  # beneath all lines
    lines = [_line(each) for each in figure.series]
    levels = [trace for each in figure.baselines for trace in _baseline(each, figure.span)]
    chart = Chart([*bands, *lines, *levels])
    chart.update_layout(
        template="simple_white",
        font={"family": FONT, "size": 14, "color": INK},
        margin={"l": 64, "r": 16, "t": 16, "b": 56},
        hovermode="x unified",
        hoverlabel={"bgcolor": "rgba(255, 255, 255, 0.95)"},
        legend={"orientation": "h", "yanchor": "top", "y": -0.18, "x": 0, "entrywidth": 250, "itemsizing": "trace"},
        xaxis={"title": figure.x_label, "range": _edges(figure.span), "dtick": max(1, round(figure.span / 10))},
        yaxis={
            "title": figure.y_label,
            "range": figure.limits,
            "showgrid": True,
            "gridcolor": "#e6e6e6",
            "zeroline": False,
        },
    )
    if figure.empty:
        chart.add_annotation(text="no results yet", showarrow=False, xref="paper", yref="paper", x=0.5, y=0.5)
    return chart


def _line(series: Series) -> "Scatter":
    from plotly.graph_objects import Scatter

    look = series.style
    return Scatter(
        x=[point.evaluations for point in series.points],
        y=[point.mean for point in series.points],
        name=escape(series.name),
        legendgroup=escape(series.name),
        mode="lines+markers",
        line={"color": look.color, "dash": DASHES[look.dash], "width": 2.25},
        marker={"symbol": MARKERS[look.marker], "size": 9, "line": {"color": "white", "width": 1}},
        customdata=[_spread(point) for point in series.points],
        hovertemplate="%{y:.3f} %{customdata}",
    )


def _band(series: Series) -> "Scatter":
    from plotly.graph_objects import Scatter

    ends = [point for point in series.points if point.lower is not None and point.upper is not None]
    return Scatter(
        x=[point.evaluations for point in [*ends, *reversed(ends)]],
        y=[*(point.upper for point in ends), *(point.lower for point in reversed(ends))],
        legendgroup=escape(series.name),
        showlegend=False,
        fill="toself",
        fillcolor=tint(series.style.color, 0.13),
        line={"width": 0},
        mode="lines",
        hoverinfo="skip",
    )


def _baseline(baseline: Baseline, span: int) -> tuple["Scatter", ...]:
    from plotly.graph_objects import Scatter

    level, look, name = baseline.level, baseline.style, escape(baseline.name)
    edges = _edges(span)
    line = Scatter(
        x=edges,
        y=[level.mean, level.mean],
        name=name,
        legendgroup=name,
        mode="lines",
        line={"color": look.color, "dash": DASHES[look.dash], "width": 1.5},
        hoverinfo="skip",
    )
    if level.lower is None or level.upper is None:
        return (line,)
    spread = Scatter(
        x=[*edges, *reversed(edges)],
        y=[level.upper, level.upper, level.lower, level.lower],
        legendgroup=name,
        showlegend=False,
        fill="toself",
        fillcolor=tint(look.color, 0.07),
        line={"width": 0},
        mode="lines",
        hoverinfo="skip",
    )
    return (spread, line)


def _edges(span: int) -> list[float]:
    """The ends of the horizontal axis, with room for the first and the last marker."""
    return [-0.02 * span, 1.02 * span]


def _spread(point: Point) -> str:
    return f"± {point.sd:.3f} (n = {point.n})" if point.sd is not None else f"(n = {point.n})"


def _table(figure: Figure) -> str:
    """The figure for a screen reader, and for whoever wants to copy a number."""
    counts = range(figure.span + 1)
    head = "".join(f'<th scope="col">{count}</th>' for count in counts)
    rows = [_row(each.name, {point.evaluations: point for point in each.points}, counts) for each in figure.series]
    rows += [_row(each.name, {0: each.level}, counts) for each in figure.baselines]
    return (
        f'<table><thead><tr><th scope="col">Evaluations</th>{head}</tr></thead><tbody>{"".join(rows)}</tbody></table>'
    )


def _row(name: str, points: dict[int, Point], counts: range) -> str:
    cells = "".join(f"<td>{_cell(points.get(count))}</td>" for count in counts)
    return f'<tr><th scope="row">{escape(name)}</th>{cells}</tr>'


def _cell(point: Point | None) -> str:
    if point is None:
        return ""
    return f"{point.mean:.3f}{f' ± {point.sd:.3f}' if point.sd is not None else ''} ({point.n})"
