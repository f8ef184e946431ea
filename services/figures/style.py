"""How the marks of a figure are told apart: by colour, by dash and by marker, any one of which is enough.

Source: the palette is Okabe and Ito 2008, "Color Universal Design", which people with every kind of colour vision can
tell apart, without its yellow, which is too light for a line on white. Shades are those of matplotlib's *plasma*, whose
lightness falls evenly, without its ends, which are too near to a white page and to a dark one.
"""

from dataclasses import dataclass
from typing import Literal

Dash = Literal["solid", "dashed", "dotted", "dashdot", "long", "longdot"]
Marker = Literal["circle", "square", "triangle", "diamond", "inverted", "cross", "star"]

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
DASHES: tuple[Dash, ...] = ("solid", "dashed", "dashdot", "long", "dotted", "longdot")
MARKERS: tuple[Marker, ...] = ("circle", "square", "triangle", "diamond", "inverted", "cross")
INK = "#222222"
"""The colour of text: what is drawn in it is light on a dark page."""

SHADES = ("#FDAE32", "#F2844B", "#E16462", "#CB4679", "#B02991", "#900DA4", "#6A00A8")
"""From light to dark."""


@dataclass(frozen=True)
class Style:
    """The look of one mark."""

    color: str
    dash: Dash
    marker: Marker

    @property
    def ink(self) -> bool:
        """Whether it has the colour of text."""
        return self.color == INK


def style_of(position: int) -> Style:
    """The style of the mark at this position of its figure; the first 36 differ from one another."""
    turn, index = divmod(position, len(COLORS))
    return Style(COLORS[index], DASHES[(index + turn) % len(DASHES)], MARKERS[(index + turn) % len(MARKERS)])


def tint(color: str, opacity: float) -> str:
    """A colour like `#0072B2` as CSS with an opacity."""
    red, green, blue = (int(color[at : at + 2], 16) for at in (1, 3, 5))
    return f"rgba({red}, {green}, {blue}, {opacity})"
