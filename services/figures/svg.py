"""Figures as SVG for papers, by matplotlib: the same bytes for the same figure."""

from io import StringIO
from math import ceil
from threading import Lock
from typing import TYPE_CHECKING, Any

from services.figures.definition import Baseline, Figure, Point, Series
from services.figures.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH_IN = 4.8  # the text width of Springer's LNCS, in which the paper stands
HEIGHT_IN = 3.1
LEGEND_ROW_IN = 0.15
WIDE = 36  # letters of a name, beyond which a legend has room for one column only

DASHES: dict[str, Any] = {
    "solid": "-",
    "dashed": (0, (4, 1.6)),
    "dotted": (0, (1, 1.4)),
    "dashdot": (0, (5, 1.4, 1, 1.4)),
    "long": (0, (8, 2)),
    "longdot": (0, (7, 1.4, 1, 1.4, 1, 1.4)),
}
MARKERS = {"circle": "o", "square": "s", "triangle": "^", "diamond": "D", "inverted": "v", "cross": "X"}

LOOK: Any = {
    "svg.hashsalt": "gaplab",
    "text.parse_math": False,  # names may have dollars in them
    "font.family": "DejaVu Sans",
    "font.size": 8,
    "axes.titlesize": 9,
    "axes.edgecolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": 7.5,
}

_matplotlib = Lock()  # its settings are global to the process, and an API has many threads


def render_svg(figure: Figure) -> str:
    """The figure as an SVG document, its letters as paths, so that it looks alike everywhere."""
    with _matplotlib:
        return _render(figure)


def _render(figure: Figure) -> str:
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure as Canvas

    with rc_context(LOOK):
        canvas = Canvas(figsize=(WIDTH_IN, HEIGHT_IN + LEGEND_ROW_IN * _rows(figure)), layout="constrained")
        FigureCanvasSVG(canvas)
        axes = canvas.add_subplot()
        _draw(figure, axes)
        canvas.supxlabel(figure.note, fontsize=6.5, color="#555555", x=0.01, ha="left", wrap=True)
        target = StringIO()
        canvas.savefig(target, format="svg", metadata={"Date": None, "Creator": "gaplab", "Title": figure.title})
    return target.getvalue()


def _draw(figure: Figure, axes: "Axes") -> None:
    from matplotlib.ticker import MaxNLocator

    for order, series in enumerate(figure.series):
        _draw_series(series, axes, 10 - 0.1 * order)
    for baseline in figure.baselines:
        _draw_baseline(baseline, axes)
    if figure.title:
        title = axes.set_title(figure.title, loc="left", fontweight="bold")
        title.set_in_layout(len(figure.title) <= WIDE)  # a wide one may end outside, but not squeeze the axes
    axes.set(xlabel=figure.x_label, ylabel=figure.y_label)
    axes.set(xlim=(-0.02 * figure.span, 1.02 * figure.span), ylim=figure.limits)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=11, integer=True))
    axes.grid(axis="y", color="#e6e6e6", linewidth=0.5)
    axes.set_axisbelow(True)
    if figure.empty:
        axes.text(0.5, 0.5, "no results yet", transform=axes.transAxes, ha="center", color="#777777")
    else:
        columns = _columns(figure)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=columns, frameon=False, handlelength=3.2)


def _draw_series(series: Series, axes: "Axes", order: float) -> None:
    x = [point.evaluations for point in series.points]
    look = series.style
    axes.plot(
        x,
        [point.mean for point in series.points],
        color=look.color,
        linestyle=DASHES[look.dash],
        marker=MARKERS[look.marker],
        linewidth=1.2,
        markersize=3.6,
        markeredgecolor="white",
        markeredgewidth=0.4,
        label=_label(series.name),
        zorder=order,
    )
    lower, upper = _band(series.points)
    axes.fill_between(x, lower, upper, color=look.color, alpha=0.13, linewidth=0, zorder=2)


def _draw_baseline(baseline: Baseline, axes: "Axes") -> None:
    level, color = baseline.level, baseline.style.color
    axes.axhline(
        level.mean, color=color, linestyle=DASHES[baseline.style.dash], linewidth=0.9, label=baseline.name, zorder=2
    )
    if level.lower is not None and level.upper is not None:
        axes.axhspan(level.lower, level.upper, color=color, alpha=0.07, linewidth=0, zorder=1)


def _columns(figure: Figure) -> int:
    names = [each.name for each in figure.series] + [each.name for each in figure.baselines]
    return 2 if all(len(name) <= WIDE for name in names) else 1


def _rows(figure: Figure) -> int:
    return ceil((len(figure.series) + len(figure.baselines)) / _columns(figure))


def _label(name: str) -> str:
    """The name in the legend, which leaves out what begins with an underscore."""
    return f" {name}" if name.startswith("_") else name


def _band(points: tuple[Point, ...]) -> tuple[list[float], list[float]]:
    """The ends of the band; where there is none, it has no width."""
    lower = [point.mean if point.lower is None else point.lower for point in points]
    upper = [point.mean if point.upper is None else point.upper for point in points]
    return lower, upper
