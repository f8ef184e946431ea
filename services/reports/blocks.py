"""The parts of a report, independent of its format."""

from dataclasses import dataclass

from gaplab.services.figures.marks import FigureDefinition
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
    """A whole report.

    Attributes:
        id: id of its study or experiment.
        title: name of the study or experiment.
        subtitle: what it is, in one line.
        headline: the verdict in a sentence or two.
        sections: the rest, in the order of reading.
    """

    id: str
    title: str
    subtitle: str
    headline: str
    sections: tuple[Section, ...]
