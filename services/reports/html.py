"""Reports as one HTML file: no script, figures inside, fit for printing."""

from base64 import b64encode
from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined

from gaplab.services.figures.marks import FigureDefinition
from gaplab.services.figures.matplotlib.files import render_file
from gaplab.services.reports.blocks import Report

WIDTH_IN = 7.2
"""Width of a figure: the text of a page."""


def render_html(report: Report, made: str) -> str:
    """Return the report as a page that needs no other file.

    Args:
        report: the content.
        made: how and when the report was made, in one line.
    """
    return _environment().get_template("report.html").render(report=report, made=made)


@cache
def _environment() -> Environment:
    found = Environment(
        loader=PackageLoader("gaplab.services.reports", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.tests["block"] = lambda block, name: type(block).__name__ == name
    found.filters["picture"] = _picture
    return found


def _picture(figure: FigureDefinition) -> str:
    """Return the figure as an address with its SVG inside; an SVG in its own element shares no ids with others."""
    svg = render_file(figure, "svg", width_in=WIDTH_IN, caption=False)
    return f"data:image/svg+xml;base64,{b64encode(svg).decode()}"
