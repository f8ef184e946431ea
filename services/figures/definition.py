"""What the figure of curves shows: the paper's Fig. 4, for any experiments."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from schemas.curves import Curve, CurvePoint
from services.figures.style import INK, Style, style_of

Band = Literal["interval", "sd"]

BANDS: dict[Band, str] = {
    "interval": "95\N{NO-BREAK SPACE}% interval of the mean",
    "sd": "one standard deviation",
}

FEW = 5  # repetitions; Student's t widens the interval of fewer to 1.6 SD and more, of two to 9 SD
LONGEST = 60  # characters of a name or a title in a figure


@dataclass(frozen=True)
class Point:
    """The mean after so many real-world evaluations, over n repetitions, and the ends of its band if it has one."""

    evaluations: int
    mean: float
    n: int
    sd: float | None
    lower: float | None
    upper: float | None


@dataclass(frozen=True)
class Series:
    """One experiment's line."""

    name: str
    points: tuple[Point, ...]
    style: Style


@dataclass(frozen=True)
class Baseline:
    """A level to compare with, evolved in reality itself: drawn across the whole width, with its SD."""

    name: str
    level: Point
    style: Style


@dataclass(frozen=True)
class Figure:
    """Everything that is drawn, in words and numbers.

    Attributes:
        note: how many repetitions there are, and what the bands are.
        span: of the horizontal axis; the greatest number of evaluations, at least 1.
        limits: of the vertical axis; a band that is very wide, as of two repetitions, runs out of the frame.
    """

    title: str
    x_label: str
    y_label: str
    note: str
    span: int
    limits: tuple[float, float]
    series: tuple[Series, ...]
    baselines: tuple[Baseline, ...]

    @property
    def empty(self) -> bool:
        """Whether there is nothing to draw yet."""
        return not self.baselines and not any(each.points for each in self.series)


def curves_figure(curves: Sequence[Curve], *, title: str = "", band: Band | None = None) -> Figure:
    """The recorded fitness of experiments against their number of real-world evaluations.

    A point without a mean (no repetition got there yet) is left out; a band needs two repetitions.

    Args:
        curves: in the order of the legend.
        title: above the figure; nothing if empty.
        band: around the lines; left out: the interval, or the SD if there are too few repetitions for an interval to
            be narrower than the figure. The direct baseline has always its SD, as in the paper.
    """
    band = band or _telling_band(curves)
    names = _names(curves)
    lines = [(name, each) for name, each in zip(names, curves, strict=True) if not each.direct]
    levels = [(name, each) for name, each in zip(names, curves, strict=True) if each.direct]
    series = tuple(Series(name, _points(each, band), style_of(at)) for at, (name, each) in enumerate(lines))
    baselines = tuple(
        Baseline(name, level, Style(INK, style_of(at + 1).dash, "circle"))
        for at, (name, each) in enumerate(levels)
        for level in _points(each, "sd")[:1]
    )
    return Figure(
        title=_printable(title),
        x_label="Number of real-world evaluations",
        y_label=_fitness_label({each.unit for each in curves}),
        note=_note(series, baselines, band),
        span=max([1, *(point.evaluations for each in series for point in each.points)]),
        limits=_limits([*(point for each in series for point in each.points), *(each.level for each in baselines)]),
        series=series,
        baselines=baselines,
    )


def _points(curve: Curve, band: Band) -> tuple[Point, ...]:
    return tuple(
        Point(each.evaluations, each.mean, each.n, each.sd, *_ends(each, band))
        for each in curve.points
        if each.mean is not None
    )


def _telling_band(curves: Sequence[Curve]) -> Band:
    counts = [point.n for each in curves if not each.direct for point in each.points if point.n]
    return "interval" if min(counts, default=FEW) >= FEW else "sd"


def _ends(point: CurvePoint, band: Band) -> tuple[float | None, float | None]:
    if band == "interval":
        return point.lower, point.upper
    if point.mean is None or point.sd is None:
        return None, None
    return point.mean - point.sd, point.mean + point.sd


def _limits(points: Sequence[Point]) -> tuple[float, float]:
    """Room for all means, and for as much of the bands above and below as the means themselves take."""
    if not points:
        return 0.0, 1.0
    least, most = min(each.mean for each in points), max(each.mean for each in points)
    room = max(most - least, 0.1 * abs(most), 1e-9)
    lowest = max(least - room, min(each.mean if each.lower is None else each.lower for each in points))
    highest = min(most + room, max(each.mean if each.upper is None else each.upper for each in points))
    margin = 0.05 * max(highest - lowest, room)
    return lowest - margin, highest + margin


def _names(curves: Sequence[Curve]) -> list[str]:
    """Names as people write them; of two that are alike each carries its experiment's id."""
    names = [_spoken(each.name) for each in curves]
    often = Counter(names)
    return [
        f"{name} ({each.experiment[:8]})" if often[name] > 1 else name for name, each in zip(names, curves, strict=True)
    ]


def _spoken(name: str) -> str:
    """`known_fit` is written *Known fit*; a name that a person gave stays as it is."""
    identifier = re.fullmatch(r"[a-z][a-z0-9_]*", name)
    return _printable(name.replace("_", " ").capitalize() if identifier else name)


def _printable(text: str) -> str:
    """The text as every renderer can show it, cut to a line."""
    shown = "".join(each if each.isprintable() else "\N{REPLACEMENT CHARACTER}" for each in text)
    return shown if len(shown) <= LONGEST else f"{shown[: LONGEST - 1]}…"


def _fitness_label(units: Iterable[str]) -> str:
    known = set(units)
    unit = known.pop() if len(known) == 1 else ""
    return f"Fitness in reality ({_printable(unit)})" if unit not in {"", "1"} else "Fitness in reality"


def _note(series: Sequence[Series], baselines: Sequence[Baseline], band: Band) -> str:
    """What a caption must say: n, the bands, the baseline."""
    counts = [point.n for each in series for point in each.points]
    parts = [f"Mean over {_range(counts)} repetitions; bands: {BANDS[band]}."] if counts else []
    parts += [f"{each.name}: evolved in reality itself, {_level(each.level)}." for each in baselines]
    return " ".join(parts)


def _level(level: Point) -> str:
    spread = f" ± {level.sd:.2f} SD" if level.sd is not None else ""
    return f"{level.mean:.2f}{spread} (n = {level.n})".replace(" ", "\N{NO-BREAK SPACE}")


def _range(counts: Sequence[int]) -> str:
    least, most = min(counts), max(counts)
    return f"{least}" if least == most else f"{least}\N{EN DASH}{most}"
