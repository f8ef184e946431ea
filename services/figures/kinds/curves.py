"""Curves: recorded fitness against its cost, as in the paper's Fig. 4."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from gaplab.schemas.curves import OF_UNTUNED, Curve, CurvePoint, Fitness, from_before
from gaplab.services.figures.marks import Axis, FigureDefinition, Level, Line, Mark, Panel, Table, faint_lines
from gaplab.services.figures.style import INK, Dash, Style, strategy_styles
from gaplab.services.figures.words import distinct_names, drawable, heading, limits, number, number_of, with_unit

Band = Literal["interval", "sd"]

BANDS: dict[Band, str] = {"interval": "95\N{NO-BREAK SPACE}% interval of the mean", "sd": "one standard deviation"}

EVALUATIONS = "Number of real-world evaluations"

RECORDINGS, ERROR = "Number of recordings used", "Error on held-out recordings (× untuned)"
"""Labels of the axes, if reality is recorded."""

BASELINES: tuple[Dash, ...] = ("dashed", "dashdot", "long", "longdot", "solid")
"""Dashes of direct baselines; the best of several direct searches is dotted."""

FEW = 5  # with fewer repetitions, Student's t widens the interval to 1.6 SD and more, with two to 9 SD


@dataclass(frozen=True)
class CostAxis:
    """A horizontal axis other than the number of real-world evaluations, with its explanation in the caption.

    Attributes:
        label: its label.
        note: the explanation.
        at: x by experiment and number of real-world evaluations; points without an x are not drawn.
    """

    label: str
    note: str
    at: Mapping[tuple[str, int], float]


@dataclass(frozen=True)
class _Placed:
    """A curve with its name in the legend, and its points that can be drawn, as `(x, mean, point)`."""

    name: str
    curve: Curve
    points: tuple[tuple[float, float, CurvePoint], ...]


def curves_figure(
    curves: Sequence[Curve],
    *,
    title: str = "",
    band: Band | None = None,
    against: CostAxis | None = None,
    each: bool = False,
    beside: Sequence[Curve] = (),
) -> FigureDefinition:
    """Return a figure of fitness in reality against the number of real-world evaluations, or against their cost.

    A point without a mean, or with one too large to compute with, is left out. The band is by default the interval, or
    the SD if few repetitions would make the interval fill the figure; it needs two repetitions. `each` adds a faint
    line for every repetition, `beside` thin lines: the same experiments' curves of transferred controllers alone.
    """
    errors = bool(curves) and all(one.unit == OF_UNTUNED for one in curves)
    curves = [_drawable(_as_error(one) if errors else one) for one in curves]
    band = band or _default_band(curves)
    names = distinct_names([(one.name, one.strategy, one.study_name, one.experiment) for one in curves])
    placed = [_placed(name, one, against) for name, one in zip(names, curves, strict=True)]
    lines = [one for one in placed if not one.curve.level]
    levels = [one for one in placed if one.curve.level and one.points]
    styled = list(zip(lines, strategy_styles([one.curve.strategy for one in lines]), strict=True))
    marks: list[Mark] = [_mean(one, band, style) for one, style in styled]
    marks += [_repetitions(one, against, style) for one, style in styled if each and one.points]
    thin = [mark for one, style in styled for mark in _thin(one, beside, against, style)]
    marks += [*thin, *(_level(one, band, style) for one, style in zip(levels, _level_styles(levels), strict=True))]
    span = max([1.0, *(x for one in lines for x, _, _ in one.points)])
    found = [best_of_line(one.name, one.curve, span) for one in levels] if lines and not against else []
    best_of = [line for line in found if line]
    marks += best_of
    evaluations = RECORDINGS if errors else EVALUATIONS + from_before(*(one.curve.known for one in lines))
    x = Axis(against.label if against else evaluations, (-0.02 * span, 1.02 * span), whole=against is None)
    fitness = with_unit("Fitness in reality", {one.unit for one in curves})
    y = Axis(ERROR if errors else fitness, _limits(marks))
    caption = _caption(lines, levels, BANDS[band], against, each=each, thin=bool(thin))
    return FigureDefinition(
        name="curves",
        title=heading(title),
        panels=(Panel(tuple(marks), x, y),),
        caption=" ".join([caption, *(best_of_in_words(line, span) for line in best_of)]),
        alt=_alt(lines, levels, best_of, x, y),
        table=_table(placed, best_of),
    )


def _as_error(curve: Curve) -> Curve:
    """Return the curve of an error, of what is recorded as minus that error."""

    def minus(value: float | None) -> float | None:
        return None if value is None else -value

    def turned(point: CurvePoint) -> CurvePoint:
        ends = {"mean": minus(point.mean), "lower": minus(point.upper), "upper": minus(point.lower)}
        return point.model_copy(update={**ends, "values": tuple(map(minus, point.values))})

    return curve.model_copy(update={"points": tuple(map(turned, curve.points))})


def _drawable(curve: Curve) -> Curve:
    points, best = tuple(map(_drawable_point, curve.points)), tuple(map(drawable, curve.best_of))
    return curve.model_copy(update={"points": points, "best_of": best})


def _drawable_point(point: CurvePoint) -> CurvePoint:
    known = {name: drawable(getattr(point, name)) for name in ("mean", "sd", "lower", "upper")}
    return point.model_copy(update={**known, "values": tuple(map(drawable, point.values))})


def _placed(name: str, curve: Curve, against: CostAxis | None) -> _Placed:
    found = [(_place(curve, point, against), point.mean, point) for point in curve.points]
    return _Placed(
        name, curve, tuple((x, mean, point) for x, mean, point in found if x is not None and mean is not None)
    )


def _place(curve: Curve, point: CurvePoint, against: CostAxis | None) -> float | None:
    if against is None or curve.level:
        return point.evaluations
    return against.at.get((curve.experiment, point.evaluations))


def _default_band(curves: Sequence[Curve]) -> Band:
    counts = [point.n for one in curves for point in one.points if point.n]
    return "interval" if min(counts, default=FEW) >= FEW else "sd"


def _mean(one: _Placed, band: Band, style: Style) -> Line:
    ends = [_ends(point, band) for _, _, point in one.points]
    return Line(
        one.name,
        tuple(x for x, _, _ in one.points),
        tuple(mean for _, mean, _ in one.points),
        style,
        lower=tuple(lower for lower, _ in ends),
        upper=tuple(upper for _, upper in ends),
        hover=tuple(_written(point, n="n = ") for _, _, point in one.points),
    )


def _repetitions(one: _Placed, against: CostAxis | None, style: Style) -> Line:
    points = one.curve.points
    places = [_place(one.curve, point, against) for point in points]
    values = [() if place is None else point.values for place, point in zip(places, points, strict=True)]
    rows = [
        [each[repetition] if repetition < len(each) else None for each in values]
        for repetition in range(max(len(point.values) for point in points))
    ]
    return faint_lines(one.name, places, rows, style)


def _thin(one: _Placed, beside: Sequence[Curve], against: CostAxis | None, style: Style) -> list[Mark]:
    """Return the thin line beside a curve; nothing without points."""
    same = (each for each in beside if each.experiment == one.curve.experiment)
    found = [each for curve in same for each in _placed(one.name, _drawable(curve), against).points]
    hover = tuple(f"transferred alone: {_written(point, n='n = ')}" for _, _, point in found)
    x, y = tuple(x for x, _, _ in found), tuple(mean for _, mean, _ in found)
    return [Line(one.name, x, y, replace(style, thin=True), hover=hover, markers=False)] if found else []


def _level(one: _Placed, band: Band, style: Style) -> Level:
    ((_, mean, point), *_) = one.points
    return Level(one.name, mean, style, *_ends(point, band), marked=not style.ink)


def _level_styles(levels: Sequence[_Placed]) -> list[Style]:
    """Return the styles of levels: the colour of text for the direct baseline, and of their strategies for others."""
    looks = zip(levels, strategy_styles([one.curve.strategy for one in levels]), strict=True)
    return [
        Style(INK, BASELINES[position % len(BASELINES)], "circle") if one.curve.direct else style
        for position, (one, style) in enumerate(looks)
    ]


def _ends(point: CurvePoint, band: Band) -> tuple[float | None, float | None]:
    if band == "interval":
        return point.lower, point.upper
    if point.mean is None or point.sd is None:
        return None, None
    return point.mean - point.sd, point.mean + point.sd


def _limits(marks: Sequence[Mark]) -> tuple[float, float]:
    """Return limits around all that is drawn: means, bands and single repetitions. Nothing is cut off."""
    lines = [mark for mark in marks if isinstance(mark, Line)]
    levels = [mark for mark in marks if isinstance(mark, Level)]
    values = [y for mark in lines for ys in (mark.y, mark.lower, mark.upper) for y in ys]
    return limits([*values, *(end for each in levels for end in (each.value, each.lower, each.upper))])


def _caption(
    lines: Sequence[_Placed], levels: Sequence[_Placed], band: str, against: CostAxis | None, *, each: bool, thin: bool
) -> str:
    counts = [point.n for one in lines for _, _, point in one.points]
    bands = f"; bands: {band}" if any(point.sd is not None for one in lines for _, _, point in one.points) else ""
    parts = [f"Mean over {number_of('repetition', *counts)}{bands}."] if counts else []
    parts += sorted({f"{one.curve.fitness.words}." for one in lines if one.curve.fitness is not Fitness.RECORDED})
    parts += ["Thin lines: transferred controllers alone."] if thin else []
    parts += ["Faint lines: single repetitions."] if counts and each else []
    known = [one.curve.known for one in lines]
    parts += [f"{number_of('sample', *known)} from before are not counted."] if any(known) else []
    parts += [against.note] if against else []
    parts += [f"{one.name}: {_origin(one.curve)}, {_level_in_words(one)}." for one in levels]
    return " ".join(parts)


def _origin(level: Curve) -> str:
    if level.unit == OF_UNTUNED:
        return "tuned on all recordings that are not held out"
    return "evolved in reality itself" if level.direct else "without samples"


def _level_in_words(one: _Placed) -> str:
    ((_, mean, point), *_) = one.points
    deviation = f" ± {point.sd:.2f} SD" if point.sd is not None else ""
    return f"{mean:.2f}{deviation} (n = {point.n})".replace(" ", "\N{NO-BREAK SPACE}")


def _alt(lines: Sequence[_Placed], levels: Sequence[_Placed], best_of: Sequence[Line], x: Axis, y: Axis) -> str:
    told = [
        f"{one.name} goes from {number(one.points[0][1])} to {number(one.points[-1][1])}" for one in lines if one.points
    ]
    told += [f"{one.name} is at {number(one.points[0][1])}" for one in levels]
    told += [f"{line.name}, ends at {number(line.y[-1])}" for line in best_of]
    return f"{y.label} against {x.label[0].lower()}{x.label[1:]}: {'; '.join(told) or 'no results yet'}."


def _table(placed: Sequence[_Placed], best_of: Sequence[Line]) -> Table:
    counts = sorted({point.evaluations for one in placed for _, _, point in one.points})
    rows = [(one.name, {point.evaluations: _written(point) for _, _, point in one.points}) for one in placed]
    rows += [(line.name, dict(enumerate(line.hover))) for line in best_of]
    return Table(
        ("Mean ± SD (n) by number of evaluations", *map(str, counts)),
        tuple((name, *(cells.get(count, "") for count in counts)) for name, cells in rows),
    )


def _written(point: CurvePoint, n: str = "") -> str:
    deviation = f" ± {point.sd:.3f}" if point.sd is not None else ""
    return f"{point.mean:.3f}{deviation} ({n}{point.n})"


def best_of_line(name: str, direct: Curve, last: float) -> Line | None:
    """Return the expected fitness of the best of e + 1 direct searches, at each number e of real-world evaluations.

    The recorded fitness after e samples is the largest of e + 1 controllers: the samples and the transferred one. In
    perfect simulators, and with searches of equal size, *simulated fit* would follow this line. A curve between the
    level of direct and the line has no better controllers than single direct searches. The samples of *random*, *known
    fit* and *informative* are not searched for fitness, so their curves may stay below.

    The line ends at half of the direct searches, or at the `last` evaluations of the figure; None if there are too few.
    """
    best = direct.best_of[: int(last) + 1]
    if not best:
        return None
    hover = tuple(f"{each:.3f} (best of {size})" if each is not None else "" for size, each in enumerate(best, 1))
    return Line(
        f"{name}, best of as many searches",
        tuple(range(len(best))),
        best,
        Style(INK, "dotted", "circle"),
        hover=hover,
        markers=False,
    )


def best_of_in_words(line: Line, last: float) -> str:
    """Return the explanation of the line for the caption."""
    told = f"{line.name}: mean of the best of e + 1, drawn at e evaluations; their own evaluations are not counted."
    return f"{told} It ends at half of them." if len(line.x) <= last else told
