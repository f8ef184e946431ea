"""What stands around the panels of a file: title, legend, the bar of shades, caption."""

from dataclasses import dataclass
from math import ceil, inf
from typing import TYPE_CHECKING, Any

from gaplab.services.figures.marks import Arrow, Figure, Label, Line, Points
from gaplab.services.figures.matplotlib.artists import legend_name
from gaplab.services.figures.matplotlib.text_size import lines, shortened, shown, width_in

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

LEGEND_PT, CAPTION_PT, TITLE_PT = 8, 7, 8
ROW_IN = 0.1445  # of a legend
HANDLE_IN, BETWEEN_IN = 0.46, 0.16  # beside the words of a legend, and between its columns
LINE_IN = 0.125  # of a caption
MARGIN_IN = 0.06
BOLD = 1.15  # how much wider bold letters are, at most


@dataclass(frozen=True)
class Beneath:
    """How much room is needed above and beneath the panels, and for what.

    Attributes:
        columns: of the legend.
        legend_in: its height.
        caption: its lines.
        title: its lines.
        width: of the file.
        sides: room that is left free at either side.
    """

    columns: int
    legend_in: float
    caption: tuple[str, ...]
    title: tuple[str, ...]
    width: float
    sides: float

    @staticmethod
    def of(figure: Figure, width: float, sides: float = 0.0, *, caption: bool) -> "Beneath":
        """The room that a figure of this width in inches needs."""
        names = _names(figure)
        columns = next((each for each in (4, 3, 2) if _legend_in(names, each) <= width - 2 * MARGIN_IN), 1)
        return Beneath(
            columns=columns,
            legend_in=ceil(len(names) / columns) * ROW_IN + (MARGIN_IN if names else 0),
            caption=tuple(lines(figure.caption, CAPTION_PT, width - 2 * MARGIN_IN)) if caption else (),
            title=tuple(lines(figure.title, TITLE_PT * BOLD, width - 2 * MARGIN_IN)),
            width=width,
            sides=sides,
        )

    @property
    def above_in(self) -> float:
        """Of the title."""
        return len(self.title) * LINE_IN + 1.25 * MARGIN_IN if self.title else 0.0

    @property
    def height_in(self) -> float:
        """Of legend and caption."""
        return self.legend_in + (len(self.caption) * LINE_IN + 2 * MARGIN_IN if self.caption else 0)


def surround(canvas: "Canvas", figure: Figure, room: Beneath) -> None:
    """Make room for title, legend and caption around the panels, and draw them."""
    height = canvas.get_figheight() + room.above_in + room.height_in
    canvas.set_figheight(height)
    bottom, top = room.height_in / height, 1 - room.above_in / height
    left, side = MARGIN_IN / room.width, room.sides / room.width
    engine: Any = canvas.get_layout_engine()
    engine.set(rect=(side, bottom, 1 - 2 * side, top - bottom))
    if room.title:
        words = "\n".join(map(shown, room.title))
        title = canvas.text(left, 1 - MARGIN_IN / height, words, va="top", weight="bold", size=TITLE_PT)
        title.set_in_layout(False)
    _legend(canvas, _names(figure), room, bottom)
    for number, line in enumerate(room.caption):
        y = (LINE_IN * (len(room.caption) - number) + MARGIN_IN) / height
        note = canvas.text(left, y, shown(line), size=CAPTION_PT, color="#555555", va="top")
        note.set_in_layout(False)


def _legend(canvas: "Canvas", names: list[str], room: Beneath, bottom: float) -> None:
    found: dict[str, Any] = {}
    for axes in canvas.axes:
        for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(name, handle)
    if not found:
        return
    named = [each for each in names if each in found]
    legend = canvas.legend(
        [found[each] for each in named],
        [shortened(shown(each), LEGEND_PT, room.width - 2 * MARGIN_IN - HANDLE_IN) for each in named],
        loc="upper center",
        bbox_to_anchor=(0.5, bottom),
        ncols=room.columns,
        frameon=False,
        handlelength=3.2,
        handletextpad=0.6,
        columnspacing=1.2,
        labelspacing=0.3,
        borderaxespad=0,
        borderpad=0.2,
    )
    legend.set_in_layout(False)


def shades_of(figure: Figure) -> tuple[float, float]:
    """The numbers that are drawn lightest and darkest."""
    values = [value for points in _shaded(figure) for value in points.shades]
    return (min(values), max(min(values) + 1, *values)) if values else (0.0, 1.0)


def draw_bar_of_shades(canvas: "Canvas", figure: Figure) -> None:
    """Draw what says which number is how dark, beside the panels, if there are shades."""
    from matplotlib.ticker import MaxNLocator

    drawn = [each for axes in canvas.axes for each in axes.collections if each.get_array() is not None]
    if not drawn:
        return
    bar = canvas.colorbar(drawn[0], ax=canvas.axes, aspect=30, pad=0.02, fraction=0.05)
    bar.set_label(shown(_shaded(figure)[0].shades_label))
    bar.outline.set_visible(False)
    bar.locator = MaxNLocator(nbins=6, integer=True)
    bar.update_ticks()


def _shaded(figure: Figure) -> list[Points]:
    return [mark for panel in figure.panels for mark in panel.marks if isinstance(mark, Points) and mark.shades]


def _legend_in(names: list[str], columns: int) -> float:
    """How wide a legend of so many columns is, which are filled one after another."""
    if len(names) < columns:
        return inf
    few, longer = divmod(len(names), columns)
    widths, start = [], 0
    for column in range(columns):
        end = start + few + (column < longer)
        widths.append(max(width_in(each, LEGEND_PT) for each in names[start:end]) + HANDLE_IN)
        start = end
    return sum(widths) + BETWEEN_IN * (columns - 1)


def _names(figure: Figure) -> list[str]:
    """What stands in the legend."""
    marks = [mark for panel in figure.panels for mark in panel.marks if not isinstance(mark, Label | Arrow)]
    named = [each.name for each in marks if each.name and not (isinstance(each, Line) and each.faint)]
    return list(dict.fromkeys(map(legend_name, named)))
