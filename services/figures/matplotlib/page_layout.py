"""The text of a file, and the parts around its panels: title, legend, colour bar, caption.

The width of a text is measured within matplotlib's settings for files.
"""

from dataclasses import dataclass
from functools import cache
from itertools import accumulate
from math import ceil, inf
from typing import TYPE_CHECKING, Any

from gaplab.services.figures.marks import Arrow, FigureDefinition, Label, Line, Polylines

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas
    from matplotlib.ft2font import FT2Font

SIZE_PT = 8
"""The size of text, in points, that all sizes and lengths here belong to; `scaled` has them at another size."""

LEGEND_PT, CAPTION_PT, TITLE_PT = 8, 7, 8
ROW_IN = 0.1445  # height of a legend entry
HANDLE_IN, BETWEEN_IN = 0.46, 0.16  # width of a legend handle, and of the gap between columns
LINE_IN = 0.125  # height of a line of the caption
MARGIN_IN = 0.06
BOLD = 1.15  # width of bold letters, as a factor

POINTS_PER_INCH = 72
MEASURED_PT = 100  # the size at which text is measured: large, since the measures are rounded
FRACTIONS = 64  # parts of a pixel, the unit of the measures


def scaled(value: float) -> float:
    """Return a size or a length that belongs to text of `SIZE_PT`, for text of matplotlib's present size."""
    from matplotlib import rcParams

    return float(value * rcParams["font.size"] / SIZE_PT)


def printable(text: str) -> str:
    """Return the text with a replacement for each character that the font does not have."""
    return "".join(each if _font().get_char_index(ord(each)) else "\N{REPLACEMENT CHARACTER}" for each in text)


def width_in(text: str, size_pt: float) -> float:
    """Return the width in inches of a line of text that has `size_pt` beside text of `SIZE_PT`."""
    font = _font()
    font.set_text(printable(text), 0.0)
    return scaled(float(font.get_width_height()[0]) / FRACTIONS / MEASURED_PT * size_pt / POINTS_PER_INCH)


def lines(text: str, size_pt: float, width: float) -> list[str]:
    """Return the text in lines of at most `width` inches; a wider word is broken."""
    found = [""]
    for word in text.split(" "):
        longer = f"{found[-1]} {word}".lstrip()
        if width_in(longer, size_pt) <= width:
            found[-1] = longer
        else:
            found += _broken(word, size_pt, width)
    return [each for each in found if each]


def shortened(text: str, size_pt: float, width: float) -> str:
    """Return the text, without its middle if it is wider than `width` inches: names often differ at their ends."""
    found = text
    for keep in range(len(text) - 1, 1, -1):
        if width_in(found, size_pt) <= width:
            break
        found = f"{text[: keep - keep // 2]}…{text[len(text) - keep // 2 :]}"
    return found


def _broken(word: str, size_pt: float, width: float) -> list[str]:
    found = [""]
    for each in word:
        if width_in(found[-1] + each, size_pt) > width:
            found.append("")
        found[-1] += each
    return found


def _font() -> "FT2Font":
    from matplotlib import rcParams

    return _font_of(rcParams["font.family"][0])


@cache
def _font_of(family: str) -> "FT2Font":
    from matplotlib.font_manager import FontProperties, findfont
    from matplotlib.ft2font import FT2Font

    font = FT2Font(findfont(FontProperties(family=[family])))
    font.set_size(MEASURED_PT, POINTS_PER_INCH)
    return font


def legend_name(name: str) -> str:
    """Return a name that matplotlib's legend shows: with a space before an underscore; an empty one is left out."""
    return f" {name}" if name.startswith("_") else name or "_nothing"


@dataclass(frozen=True)
class PageLayout:
    """The space around the panels, in inches; `columns` are those of the legend, `sides` is free left and right."""

    columns: int
    legend_in: float
    caption: tuple[str, ...]
    title: tuple[str, ...]
    width: float
    sides: float

    @staticmethod
    def of(figure: FigureDefinition, width: float, sides: float = 0.0, *, caption: bool) -> "PageLayout":
        """Return the layout of a figure with this width in inches."""
        names = _names(figure)
        columns = next((each for each in (4, 3, 2) if _legend_in(names, each) <= width - 2 * MARGIN_IN), 1)
        return PageLayout(
            columns=columns,
            legend_in=ceil(len(names) / columns) * scaled(ROW_IN) + (MARGIN_IN if names else 0),
            caption=tuple(lines(figure.caption, CAPTION_PT, width - 2 * MARGIN_IN)) if caption else (),
            title=tuple(lines(figure.title, TITLE_PT * BOLD, width - 2 * MARGIN_IN)),
            width=width,
            sides=sides,
        )

    @property
    def above_in(self) -> float:
        """Height of the title."""
        return len(self.title) * scaled(LINE_IN) + 1.25 * MARGIN_IN if self.title else 0.0

    @property
    def height_in(self) -> float:
        """Height of legend and caption."""
        return self.legend_in + (len(self.caption) * scaled(LINE_IN) + 2 * MARGIN_IN if self.caption else 0)


def add_surroundings(canvas: "Canvas", figure: FigureDefinition, layout: PageLayout) -> None:
    """Enlarge the canvas for title, legend and caption, and draw them."""
    height = canvas.get_figheight() + layout.above_in + layout.height_in
    canvas.set_figheight(height)
    bottom, top = layout.height_in / height, 1 - layout.above_in / height
    left, side = MARGIN_IN / layout.width, layout.sides / layout.width
    engine: Any = canvas.get_layout_engine()
    engine.set(rect=(side, bottom, 1 - 2 * side, top - bottom))
    if layout.title:
        words = "\n".join(map(printable, layout.title))
        title = canvas.text(left, 1 - MARGIN_IN / height, words, va="top", weight="bold", size=scaled(TITLE_PT))
        title.set_in_layout(False)
    _legend(canvas, _names(figure), layout, bottom)
    for number, line in enumerate(layout.caption):
        y = (scaled(LINE_IN) * (len(layout.caption) - number) + MARGIN_IN) / height
        note = canvas.text(left, y, printable(line), size=scaled(CAPTION_PT), color="#555555", va="top")
        note.set_in_layout(False)


def _legend(canvas: "Canvas", names: list[str], layout: PageLayout, bottom: float) -> None:
    found: dict[str, Any] = {}
    for axes in canvas.axes:
        for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(name, handle)
    if not found:
        return
    named = [each for each in names if each in found]
    legend = canvas.legend(
        [found[each] for each in named],
        [shortened(printable(each), LEGEND_PT, layout.width - 2 * MARGIN_IN - scaled(HANDLE_IN)) for each in named],
        loc="upper center",
        bbox_to_anchor=(0.5, bottom),
        ncols=layout.columns,
        frameon=False,
        handlelength=3.2,
        handletextpad=0.6,
        columnspacing=1.2,
        labelspacing=0.3,
        borderaxespad=0,
        borderpad=0.2,
    )
    legend.set_in_layout(False)


def draw_bar_of_shades(canvas: "Canvas", figure: FigureDefinition) -> None:
    """Draw the colour bar of the shades beside the panels, if there are any."""
    from matplotlib.ticker import MaxNLocator

    drawn = [each for axes in canvas.axes for each in axes.collections if each.get_array() is not None]
    if not drawn:
        return
    bar = canvas.colorbar(drawn[0], ax=canvas.axes, aspect=30, pad=0.02, fraction=0.05)
    bar.set_label(printable(figure.shaded[0].shades_label))
    bar.outline.set_visible(False)
    whole = all(value == int(value) for points in figure.shaded for value in points.shades)
    bar.locator = MaxNLocator(nbins=6, integer=whole)
    bar.update_ticks()


def _legend_in(names: list[str], columns: int) -> float:
    """Return the width of a legend whose columns are filled one after another."""
    if len(names) < columns:
        return inf
    few, longer = divmod(len(names), columns)
    sizes = [few + (column < longer) for column in range(columns)]
    widest = [
        max(width_in(name, LEGEND_PT) for name in names[end - size : end])
        for size, end in zip(sizes, accumulate(sizes), strict=True)
    ]
    return sum(widest) + scaled(HANDLE_IN * columns + BETWEEN_IN * (columns - 1))


def _names(figure: FigureDefinition) -> list[str]:
    marks = [mark for mark in figure.marks if not isinstance(mark, Label | Arrow | Polylines)]
    named = [each.name for each in marks if each.name and not (isinstance(each, Line) and each.faint)]
    return list(dict.fromkeys(map(legend_name, named)))
