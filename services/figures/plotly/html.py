"""Figures as self-contained HTML files, with Plotly inside."""

import json
from functools import cache
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

from gaplab.services.figures.marks import FigureDefinition, Table
from gaplab.services.figures.plotly.chart import chart
from gaplab.services.figures.style import INK

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Noto Sans', sans-serif"

AXIS = {
    "color": INK,
    "gridcolor": "#e6e6e6",
    "linecolor": INK,
    "showline": True,
    "ticks": "outside",
    "tickcolor": INK,
    "title": {"standoff": 8, "font": {"size": 14}},
}

CONFIG = {
    "responsive": True,
    "displaylogo": False,
    # "Share chart" would send the numbers to a company's server
    "modeBarButtonsToRemove": ["sendChartToCloud", "lasso2d", "select2d", "autoScale2d"],
}


def render_html(figure: FigureDefinition) -> str:
    """Return the figure as a page with a table of its numbers; the page makes no network request."""
    drawn = chart(figure)
    return Template(_resource("page.html")).substitute(
        title=escape(figure.title or figure.name.replace("-", " ").capitalize()),
        alt=escape(figure.alt),
        caption=escape(figure.caption),
        numbers=_numbers(figure.table) if figure.table else "",
        plotly=_resource("library", "plotly-basic.min.js"),
        data=_script(drawn["data"]),
        layout=_script(_on_white(drawn["layout"])),
        config=_script(CONFIG | {"toImageButtonOptions": {"format": "svg", "filename": f"gaplab-{figure.name}"}}),
        font=FONT,
        ink=INK,
    )


@cache
def _resource(*path: str) -> str:
    return files("gaplab.services.figures.plotly").joinpath(*path).read_text("utf-8")


def _on_white(layout: dict[str, Any]) -> dict[str, Any]:
    axes = {
        name: AXIS | each | {"title": AXIS["title"] | each["title"]}
        for name, each in layout.items()
        if name[1:].startswith("axis")
    }
    return layout | axes | {"font": {"family": FONT, "size": 13, "color": INK}, "paper_bgcolor": "#fff"}


def _script(value: object) -> str:
    return json.dumps(value, allow_nan=False).replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _numbers(table: Table) -> str:
    head = "".join(f'<th scope="col">{escape(each)}</th>' for each in table.head)
    rows = "".join(_row(*each) for each in table.rows)
    return (
        "<details><summary>The numbers</summary>\n"
        f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>\n</details>"
    )


def _row(first: str, *others: str) -> str:
    cells = "".join(f"<td>{escape(each)}</td>" for each in others)
    return f'<tr><th scope="row">{escape(first)}</th>{cells}</tr>'
