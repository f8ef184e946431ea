"""Figures as one HTML file that needs nothing else: Plotly's own JavaScript, from its Python package, is inside."""

import json
from functools import cache
from html import escape
from importlib.resources import files
from typing import Any

from gaplab.services.figures.marks import Figure, Table
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
  figcaption {{ color: #555; font-size: .875rem; max-width: 60em; margin-top: .5rem; }}
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
<div id="figure" role="img" aria-label="{alt}"></div>
<figcaption>{caption}</figcaption>
</figure>
{numbers}
<script>{plotly}</script>
<script>Plotly.newPlot("figure", {data}, {layout}, {config});</script>
</body>
</html>
"""


def render_html(figure: Figure) -> str:
    """The figure as a page, with its numbers in a table beneath; nothing in it asks the network for anything."""
    drawn = chart(figure)
    return PAGE.format(
        title=escape(figure.title or figure.name.replace("-", " ").capitalize()),
        alt=escape(figure.alt),
        caption=escape(figure.caption),
        numbers=_numbers(figure.table) if figure.table else "",
        plotly=_plotly(),
        data=_script(drawn["data"]),
        layout=_script(_lit(drawn["layout"])),
        config=_script(_config(figure.name)),
        font=FONT,
        ink=INK,
    )


@cache
def _plotly() -> str:
    return files("plotly").joinpath("package_data", "plotly.min.js").read_text("utf-8")


def _lit(layout: dict[str, Any]) -> dict[str, Any]:
    """The layout on white paper."""
    axes = {
        name: AXIS | each | {"title": AXIS["title"] | each["title"]} for name, each in layout.items() if _is_axis(name)
    }
    return layout | axes | {"font": {"family": FONT, "size": 13, "color": INK}, "paper_bgcolor": "#fff"}


def _is_axis(name: str) -> bool:
    return name.startswith(("xaxis", "yaxis"))


def _config(name: str) -> dict[str, Any]:
    return {
        "responsive": True,
        "displaylogo": False,
        # "Share chart" would send the numbers to a company's server: nothing of a figure is ever sent away
        "modeBarButtonsToRemove": ["sendChartToCloud", "lasso2d", "select2d", "autoScale2d"],
        "toImageButtonOptions": {"format": "svg", "filename": f"gaplab-{name}"},
    }


def _script(value: object) -> str:
    """The value as JSON that cannot end the script that it stands in."""
    return json.dumps(value, allow_nan=False).replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _numbers(table: Table) -> str:
    """The figure for a screen reader, and for whoever wants to copy a number."""
    head = "".join(f'<th scope="col">{escape(each)}</th>' for each in table.head)
    rows = "".join(_row(*each) for each in table.rows)
    return (
        "<details><summary>The numbers</summary>\n"
        f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>\n</details>"
    )


def _row(first: str, *others: str) -> str:
    cells = "".join(f"<td>{escape(each)}</td>" for each in others)
    return f'<tr><th scope="row">{escape(first)}</th>{cells}</tr>'
