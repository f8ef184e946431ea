"""Figures as SVG, PNG and PDF files for papers: the same bytes for the same figure.

Text has 8 pt, unless another size is asked for, at any width, by default that of one column of a paper.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from threading import Lock
from typing import TYPE_CHECKING, Any, Literal

from gaplab.services.figures.marks import Axis, FigureDefinition
from gaplab.services.figures.matplotlib.artists import draw_marks
from gaplab.services.figures.matplotlib.page_layout import (
    SIZE_PT,
    PageLayout,
    add_surroundings,
    draw_bar_of_shades,
    printable,
    width_in,
)
from gaplab.services.figures.style import INK
from gaplab.services.figures.words import power

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

FileFormat = Literal["svg", "png", "pdf"]
Font = Literal["DejaVu Sans", "DejaVu Serif", "STIXGeneral"]
"""Families of letters that matplotlib brings along, so that they are the same everywhere."""

COLUMN_IN = 3.5
"""The width of one column in most journals; two columns have 7.2."""

DPI = 300
PANEL_IN, LOW_IN = 2.1, 1.1
"""Least height of the only row of panels, and the height of one of several rows."""

SLOPE = 0.45
"""Height of the only row of panels, as a share of the width of a file: a wide curve would look flat."""

FREE = 0.85
"""Share of the width of a file that its panels have."""

SQUARE_IN = 3.2
"""Greatest height of a square panel."""


@dataclass(frozen=True)
class Look:
    """The look of a file.

    Attributes:
        width_in: its width in inches.
        height_in: height of its panels with their labels; None: as usual, which alone lets square panels be square.
        caption: write the caption below the figure.
        font: family of its letters.
        size_pt: size of its text; the caption's is 7/8 of it.
    """

    width_in: float = COLUMN_IN
    height_in: float | None = None
    caption: bool = True
    font: Font = "DejaVu Sans"
    size_pt: float = SIZE_PT


COLUMN = Look()
LOOK: Any = {
    "svg.hashsalt": "gaplab",
    "pdf.fonttype": 42,  # TrueType: publishers refuse type 3 fonts
    "text.parse_math": False,  # names may contain dollar signs
    "axes.titlesize": "medium",
    "axes.edgecolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": "medium",
}

METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Creator": "gaplab", "Date": None},
    "pdf": {"Creator": "gaplab", "Producer": None, "CreationDate": None},
    "png": {"Software": None},
}
"""No dates and no versions: the same figure gives the same bytes."""

_matplotlib = Lock()  # its settings are global to the process, and the service has many threads


def render_file(figure: FigureDefinition, kind: FileFormat, look: Look = COLUMN) -> bytes:
    """Return the figure as a file.

    An SVG has letters as paths, so that it needs no font.
    """
    with _settings(look):
        canvas = _canvas(figure, look)
        target = BytesIO()
        described = {"Title": figure.title or figure.name} | ({"Description": figure.alt} if kind != "pdf" else {})
        canvas.savefig(target, format=kind, dpi=DPI, metadata=METADATA[kind] | described)
    return target.getvalue()


def draw(figure: FigureDefinition, look: Look) -> "Canvas":
    """Return the figure as matplotlib's own, as in a file, to be changed."""
    with _settings(look):
        return _canvas(figure, look)


@contextmanager
def _settings(look: Look) -> Iterator[None]:
    from matplotlib import rc_context

    with _matplotlib, rc_context(LOOK | {"font.family": [look.font, "DejaVu Sans"], "font.size": look.size_pt}):
        yield


def _canvas(figure: FigureDefinition, look: Look) -> "Canvas":
    from matplotlib.figure import Figure as Canvas

    rows = figure.row_heights
    usual_in = sum(rows) * LOW_IN + 0.3 if len(rows) > 1 else max(PANEL_IN, SLOPE * look.width_in)
    canvas = Canvas(figsize=(look.width_in, look.height_in or usual_in), layout="constrained")
    share: Any = "col" if figure.share_x else False
    grid = canvas.subplots(len(rows), figure.columns, squeeze=False, sharex=share, gridspec_kw={"height_ratios": rows})
    for index, axes in enumerate(grid.flat):
        if index < len(figure.panels):
            _draw(figure, index, axes)
        else:
            axes.set_visible(False)
    if figure.empty:
        canvas.text(0.5, 0.6, printable(figure.nothing), ha="center", color="#777777")
    canvas.align_ylabels()
    draw_bar_of_shades(canvas, figure)
    sides = _square(canvas, len(rows)) if figure.panels[0].square and look.height_in is None else 0.0
    add_surroundings(canvas, figure, PageLayout.of(figure, look.width_in, sides, caption=look.caption))
    _fix_positions(canvas)
    return canvas


def _draw(figure: FigureDefinition, index: int, axes: "Axes") -> None:
    panel = figure.panels[index]
    _set_up(axes, panel.x, panel.y, labelled=not figure.share_x or index + figure.columns >= len(figure.panels))
    if panel.title:
        axes.set_title(printable(panel.title), loc="left")
    draw_marks(panel, axes, figure.shade_limits)


def _square(canvas: "Canvas", rows: int) -> float:
    """Change the height of the canvas until its panels are as high as wide.

    Returns:
        The free space at either side in inches, since a panel has a greatest width.
    """
    engine: Any = canvas.get_layout_engine()
    engine.execute(canvas)
    place = canvas.axes[0].get_position(original=True)
    width, height = place.width * canvas.get_figwidth(), place.height * canvas.get_figheight()
    side = min(width, SQUARE_IN)
    canvas.set_figheight(canvas.get_figheight() + rows * (side - height))
    columns = canvas.axes[0].get_gridspec().ncols  # type: ignore[union-attr]
    return columns * (width - side) / 2


def _fix_positions(canvas: "Canvas") -> None:
    """Compute the layout once, and round its positions: the solver's last digits vary from run to run."""
    engine: Any = canvas.get_layout_engine()
    engine.execute(canvas)
    canvas.set_layout_engine("none")
    for axes in canvas.axes:
        left, bottom, width, height = axes.get_position(original=True).bounds
        axes.set_position((round(left, 6), round(bottom, 6), round(width, 6), round(height, 6)))


def _set_up(axes: "Axes", x: Axis, y: Axis, *, labelled: bool) -> None:
    from matplotlib import rcParams

    axes.tick_params(labelsize=rcParams["font.size"], labelfontfamily=rcParams["font.family"])  # of later ticks too
    axes.set(ylabel=printable(y.label), xlim=x.limits, ylim=y.limits)
    if labelled:
        axes.set_xlabel(printable(x.label))
    _ticks(axes.xaxis, x)
    _ticks(axes.yaxis, y)
    axes.grid(axis="y", color="#e6e6e6", linewidth=0.5)
    axes.set_axisbelow(True)


def _fit_side_by_side(axis: Any, of: Axis) -> bool:  # noqa: ANN401 - XAxis or YAxis
    between_in = FREE * axis.get_figure().get_figwidth() / max(1, len(of.ticks))
    return bool(max(width_in(words, SIZE_PT) for _, words in of.ticks) < between_in)


def _ticks(axis: Any, of: Axis) -> None:  # noqa: ANN401 - XAxis or YAxis
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

    if of.log:
        getattr(axis.axes, f"set_{axis.axis_name}scale")("log")
        getattr(axis.axes, f"set_{axis.axis_name}lim")(of.limits)
        axis.set_major_locator(LogLocator(numticks=6))
        axis.set_major_formatter(FuncFormatter(lambda value, _: power(value)))
        axis.set_minor_formatter(NullFormatter())
    elif of.ticks:
        axis.set_ticks([at for at, _ in of.ticks], [printable(words) for _, words in of.ticks])
        if axis.axis_name == "x" and not _fit_side_by_side(axis, of):
            axis.set_tick_params(rotation=25, rotation_mode="anchor")
            for label in axis.get_ticklabels():
                label.set_horizontalalignment("right")
    elif of.whole:
        axis.set_major_locator(MaxNLocator(nbins=11, integer=True))
