"""The parts of a report, and the one HTML file that shows them, without a script and fit for printing."""

from base64 import b64encode
from dataclasses import dataclass
from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined

from gaplab.services.figures.marks import FigureDefinition
from gaplab.services.figures.matplotlib.files import Look, render_file
from gaplab.services.findings.tables import Grid as Grid


@dataclass(frozen=True)
class Paragraph:
    """A paragraph; a note is printed smaller."""

    text: str
    note: bool = False


@dataclass(frozen=True)
class Bullets:
    """A list of sentences."""

    sentences: tuple[str, ...]


@dataclass(frozen=True)
class Drawing:
    """A figure."""

    figure: FigureDefinition


@dataclass(frozen=True)
class Code:
    """Text to copy, line by line as it is."""

    text: str


Block = Paragraph | Bullets | Grid | Drawing | Code


@dataclass(frozen=True)
class Section:
    """Blocks under a heading."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Report:
    """A whole report: the name of its subject, what that is in one line, the verdict in short, and the rest."""

    id: str
    title: str
    subtitle: str
    headline: str
    sections: tuple[Section, ...]


WIDTH_IN = 7.2
"""Width of a figure: the text of a page."""


def render_html(report: Report, made: str) -> str:
    """Return the report as a page that needs no other file; `made` says in a line how and when it was made."""
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
    svg = render_file(figure, "svg", Look(WIDTH_IN, caption=False))
    return f"data:image/svg+xml;base64,{b64encode(svg).decode()}"
