"""Figures as self-contained HTML files, with Plotly inside."""

from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

from gaplab.services.figures.marks import FigureDefinition
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
    return _page().render(
        figure=figure,
        data=drawn["data"],
        layout=_on_white(drawn["layout"]),
        config=CONFIG | {"toImageButtonOptions": {"format": "svg", "filename": f"gaplab-{figure.name}"}},
        font=FONT,
        ink=INK,
    )


@cache
def _page() -> Template:
    found = Environment(
        loader=PackageLoader("gaplab.services.figures.plotly", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    found.policies["json.dumps_kwargs"] = {"allow_nan": False}
    plotly = files("gaplab.services.figures.plotly").joinpath("library", "plotly-basic.min.js").read_text("utf-8")
    return found.get_template("page.html", globals={"plotly": plotly})


def _on_white(layout: dict[str, Any]) -> dict[str, Any]:
    axes = {
        name: AXIS | each | {"title": AXIS["title"] | each["title"]}
        for name, each in layout.items()
        if name[1:].startswith("axis")
    }
    return layout | axes | {"font": {"family": FONT, "size": 13, "color": INK}, "paper_bgcolor": "#fff"}
