"""Colours, dashes and markers of marks: any one of the three tells two marks apart.

Source: the palette of Okabe and Ito 2008, "Color Universal Design", is distinct for every kind of colour vision; its
yellow is left out, since it is too light on white. The shades are matplotlib's *plasma*, whose lightness falls evenly,
without its ends, which are too close to white and to dark pages.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal
from zlib import crc32

Dash = Literal["solid", "dashed", "dotted", "dashdot", "long", "longdot"]
Marker = Literal["circle", "square", "triangle", "diamond", "inverted", "cross", "star"]

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
DASHES: tuple[Dash, ...] = ("solid", "dashed", "dashdot", "long", "dotted", "longdot")
MARKERS: tuple[Marker, ...] = ("circle", "square", "triangle", "diamond", "inverted", "cross")
STRATEGIES = (
    "simulated_fit",
    "simulated_fit_and_unique",
    "informative",
    "simulated_fit_and_informative",
    "random",
    "known_fit",
)
"""The paper's strategies with a curve, in the order of the colours, so that each has its own."""

OTHERS: dict[str, tuple[str, Dash, Marker]] = {
    "estimation_exploration": ("#D1477A", "long", "square"),
    "weighted": ("#8A8A2B", "dotted", "diamond"),
    "domain_randomization": ("#9C6B3F", "dashed", "triangle"),
    "noise_envelope": ("#7A5CC0", "dashdot", "inverted"),
    "farthest": ("#7F7F7F", "longdot", "cross"),
    "surrogate": ("#6B7FD7", "solid", "cross"),
    "fit_unless_near": ("#3E8E8E", "dashed", "square"),
    "residual": ("#6F9A37", "long", "circle"),
    "back_to_reality": ("#C0504D", "dashdot", "diamond"),
    "intelligent_trial_and_error": ("#A8479B", "long", "star"),
    "transferability": ("#2F8F5B", "dashdot", "cross"),
    "interleaved": ("#4C9AA8", "longdot", "triangle"),
    "bayrn": ("#B0746B", "dotted", "square"),
}
"""Colour, dash and marker of gaplab's other strategies; the colours are legible on white and on dark pages."""

INK = "#222222"
"""The colour of text; a dark page replaces it by a light colour."""

SHADES = ("#FDAE32", "#F2844B", "#E16462", "#CB4679", "#B02991", "#900DA4", "#6A00A8")
"""From light to dark."""


@dataclass(frozen=True)
class Style:
    """The look of one mark; a thin line stands beside another one of its name, without an entry in the legend."""

    color: str
    dash: Dash
    marker: Marker
    thin: bool = False

    @property
    def ink(self) -> bool:
        """Whether it has the colour of text."""
        return self.color == INK


def style_of(position: int) -> Style:
    """Return the style of the mark at a position in its figure; the first 36 styles are distinct."""
    turn, index = divmod(position, len(COLORS))
    return Style(COLORS[index], DASHES[(index + turn) % len(DASHES)], MARKERS[(index + turn) % len(MARKERS)])


def strategy_style(strategy: str) -> Style:
    """Return the style of a strategy, which is the same in every figure: its name alone decides.

    Each of gaplab's strategies has a colour of its own. Another has one of the 30 remaining styles, by a checksum of
    its name.
    """
    if strategy in STRATEGIES:
        return style_of(STRATEGIES.index(strategy))
    if strategy in OTHERS:
        return Style(*OTHERS[strategy])
    known, all_ = len(COLORS), len(COLORS) ** 2
    return style_of(known + crc32(strategy.encode()) % (all_ - known))


def strategy_styles(strategies: Sequence[str]) -> list[Style]:
    """Return the styles of experiments, by their strategies.

    A strategy keeps its colour. Each further experiment of it has another dash and another marker, and the first 36
    are distinct.
    """
    repeated: Counter[Style] = Counter()
    styles = []
    for strategy in strategies:
        style = strategy_style(strategy)
        turn, index = divmod(repeated[style], len(DASHES))
        dash = DASHES[(DASHES.index(style.dash) + index) % len(DASHES)]
        marker = MARKERS[(MARKERS.index(style.marker) + index + turn) % len(MARKERS)]
        styles.append(replace(style, dash=dash, marker=marker))
        repeated[style] += 1
    return styles


def tint(color: str, opacity: float) -> str:
    """Return a colour like `#0072B2` as a CSS colour with an opacity."""
    red, green, blue = (int(color[at : at + 2], 16) for at in (1, 3, 5))
    return f"rgba({red}, {green}, {blue}, {opacity})"


def shade_at(share: float) -> str:
    """Return the shade at a share of the way from light to dark, as `#0072B2`."""
    place = min(max(share, 0.0), 1.0) * (len(SHADES) - 1)
    before = min(int(place), len(SHADES) - 2)
    both = [[int(SHADES[before + after][at : at + 2], 16) for at in (1, 3, 5)] for after in (0, 1)]
    parts = (round(first + (second - first) * (place - before)) for first, second in zip(*both, strict=True))
    return "#" + "".join(f"{part:02X}" for part in parts)
