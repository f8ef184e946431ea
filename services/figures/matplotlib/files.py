"""Figures as files for papers, by matplotlib: SVG, PNG and PDF, the same bytes for the same figure.

Text is of 8 pt at the width that is asked for, which is that of one column of a paper unless said otherwise.
"""

from io import BytesIO
from threading import Lock
from typing import TYPE_CHECKING, Any, Literal

from gaplab.services.figures.marks import Axis, Figure
from gaplab.services.figures.matplotlib.artists import paint
from gaplab.services.figures.matplotlib.page_layout import Beneath, draw_bar_of_shades, shades_of, surround
from gaplab.services.figures.matplotlib.text_size import FAMILY, shown
from gaplab.services.figures.style import INK
from gaplab.services.figures.words import power

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

FileFormat = Literal["svg", "png", "pdf"]

COLUMN_IN = 3.5
"""The width of one column in most journals; of two it is 7.2."""

DPI = 300
SIZE_PT = 8
PANEL_IN, LOW_IN = 2.1, 1.1
"""Height of a row of panels, where there is one and where there are several."""

SQUARE_IN = 3.2
"""The greatest height of a square panel."""

LOOK: Any = {
    "svg.hashsalt": "gaplab",
    "pdf.fonttype": 42,  # letters as TrueType: publishers refuse type 3
    "text.parse_math": False,  # names may have dollars in them
    "font.family": FAMILY,
    "font.size": SIZE_PT,
    "axes.titlesize": SIZE_PT,
    "axes.edgecolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": SIZE_PT,
}

METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Creator": "gaplab", "Date": None},
    "pdf": {"Creator": "gaplab", "Producer": None, "CreationDate": None},
    "png": {"Software": None},
}
"""No moment and no version: the same figure is the same bytes."""

_matplotlib = Lock()  # its settings are global to the process, and an API has many threads


def render_file(figure: Figure, kind: FileFormat, *, width_in: float = COLUMN_IN, caption: bool = True) -> bytes:
    """The figure as a file; an SVG has its letters as paths, so that it looks alike everywhere.

    Args:
        figure: what is drawn.
        kind: of the file.
        width_in: its width in inches.
        caption: whether it is drawn beneath; a paper has one of its own.
    """
    from matplotlib import rc_context

    with _matplotlib, rc_context(LOOK):
        canvas = _canvas(figure, width_in, caption=caption)
        target = BytesIO()
        described = {"Title": figure.title or figure.name} | ({"Description": figure.alt} if kind != "pdf" else {})
        canvas.savefig(target, format=kind, dpi=DPI, metadata=METADATA[kind] | described)
    return target.getvalue()


def _canvas(figure: Figure, width_in: float, *, caption: bool) -> "Canvas":
    from matplotlib.figure import Figure as Canvas

    rows = _rows(figure)
    canvas = Canvas(figsize=(width_in, sum(rows) * LOW_IN + 0.3 if len(rows) > 1 else PANEL_IN), layout="constrained")
    share: Any = "col" if figure.share_x else False
    grid = canvas.subplots(len(rows), figure.columns, squeeze=False, sharex=share, gridspec_kw={"height_ratios": rows})
    for index, axes in enumerate(grid.flat):
        if index < len(figure.panels):
            _draw(figure, index, axes)
        else:
            axes.set_visible(False)
    if figure.empty:
        canvas.text(0.5, 0.6, shown(figure.nothing), ha="center", color="#777777")
    canvas.align_ylabels()
    draw_bar_of_shades(canvas, figure)
    sides = _square(canvas, len(rows)) if figure.panels[0].square else 0.0
    surround(canvas, figure, Beneath.of(figure, width_in, sides, caption=caption))
    _settle(canvas)
    return canvas


def _draw(figure: Figure, index: int, axes: "Axes") -> None:
    panel = figure.panels[index]
    _set_up(axes, panel.x, panel.y, labelled=not figure.share_x or index + figure.columns >= len(figure.panels))
    if panel.title:
        axes.set_title(shown(panel.title), loc="left")
    paint(panel, axes, shades_of(figure))


def _square(canvas: "Canvas", rows: int) -> float:
    """Make the canvas so high that its panels are as high as wide.

    Returns:
        The room in inches that is left free at either side, for no panel is wider than it should be.
    """
    engine = canvas.get_layout_engine()
    assert engine is not None
    engine.execute(canvas)
    place = canvas.axes[0].get_position(original=True)
    width, height = place.width * canvas.get_figwidth(), place.height * canvas.get_figheight()
    side = min(width, SQUARE_IN)
    canvas.set_figheight(canvas.get_figheight() + rows * (side - height))
    columns = canvas.axes[0].get_gridspec().ncols  # type: ignore[union-attr]
    return columns * (width - side) / 2


def _settle(canvas: "Canvas") -> None:
    """Lay everything out, without the last digits: the solver does not find the same ones each time."""
    engine = canvas.get_layout_engine()
    assert engine is not None
    engine.execute(canvas)
    canvas.set_layout_engine("none")
    for axes in canvas.axes:
        left, bottom, width, height = axes.get_position(original=True).bounds
        axes.set_position((round(left, 6), round(bottom, 6), round(width, 6), round(height, 6)))


def _rows(figure: Figure) -> list[float]:
    starts = range(0, len(figure.panels), figure.columns)
    return [max(panel.height for panel in figure.panels[start : start + figure.columns]) for start in starts]


def _set_up(axes: "Axes", x: Axis, y: Axis, *, labelled: bool) -> None:
    axes.set(ylabel=shown(y.label), xlim=x.limits, ylim=y.limits)
    if labelled:
        axes.set_xlabel(shown(x.label))
    _ticks(axes.xaxis, x)
    _ticks(axes.yaxis, y)
    axes.grid(axis="y", color="#e6e6e6", linewidth=0.5)
    axes.set_axisbelow(True)


def _ticks(axis: Any, of: Axis) -> None:  # noqa: ANN401 - either of an axes' two, which are of two types
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

    if of.log:
        getattr(axis.axes, f"set_{axis.axis_name}scale")("log")
        getattr(axis.axes, f"set_{axis.axis_name}lim")(of.limits)
        axis.set_major_locator(LogLocator(numticks=6))
        axis.set_major_formatter(FuncFormatter(lambda value, _: power(value)))
        axis.set_minor_formatter(NullFormatter())
    elif of.ticks:
        axis.set_ticks([at for at, _ in of.ticks], [shown(words) for _, words in of.ticks])
    elif of.whole:
        axis.set_major_locator(MaxNLocator(nbins=11, integer=True))
