"""The squared error of the best simulator on the samples, over iterations."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import median, quantiles

from gaplab.services.figures.marks import Axis, FigureDefinition, Line, Number, Panel, Table, faint_lines
from gaplab.services.figures.style import style_of
from gaplab.services.figures.words import drawable, heading, limits, number, number_of, printable

WIDE = 30.0
"""Ratio of the greatest to the least median above which the axis is logarithmic."""

LOOK = style_of(0)

Errors = Mapping[int, Number]
"""Squared errors by repetition; None if the physics failed on a sample."""


def squared_error_figure(
    errors: Mapping[int, Errors], *, unit: str = "", title: str = "", each: bool = False
) -> FigureDefinition:
    """Return a figure of the median and quartiles of the squared error after each iteration with tuning.

    Args:
        errors: squared errors by iteration; values too large to compute with are left out.
        unit: unit of fitness.
        title: text above the figure.
        each: draw a thin line for every repetition.
    """
    errors = {at: {one: drawable(value) for one, value in found.items()} for at, found in errors.items()}
    there = {at: [value for value in found.values() if value is not None] for at, found in sorted(errors.items())}
    there = {at: found for at, found in there.items() if found}
    line = _median(there)
    logarithmic = _is_wide(line.y)
    marks = (line, *([_repetitions(errors)] if each else [])) if there else ()
    panel = Panel(
        tuple(_above_zero(mark) for mark in marks) if logarithmic else marks,
        Axis("Iteration (real-world evaluations so far)", _frame(there), whole=True),
        Axis(_label(unit), _limits(marks, logarithmic=logarithmic), log=logarithmic),
    )
    return FigureDefinition(
        name="squared-error",
        title=heading(title),
        panels=(panel,),
        caption=_caption(errors, there, each=each),
        alt=_alt(line),
        table=_table(line, there),
    )


def _median(there: Mapping[int, Sequence[float]]) -> Line:
    quarters = [quantiles(found, n=4, method="inclusive") if len(found) > 1 else None for found in there.values()]
    return Line(
        "Best simulator",
        tuple(there),
        tuple(median(found) for found in there.values()),
        LOOK,
        lower=tuple(found[0] if found else None for found in quarters),
        upper=tuple(found[2] if found else None for found in quarters),
        hover=tuple(f"{number(median(found))} (n = {len(found)})" for found in there.values()),
    )


def _repetitions(errors: Mapping[int, Errors]) -> Line:
    iterations, repetitions = sorted(errors), sorted({each for found in errors.values() for each in found})
    rows = [[errors[at].get(each) for at in iterations] for each in repetitions]
    return faint_lines("Best simulator", iterations, rows, LOOK)


def _is_wide(medians: Sequence[Number]) -> bool:
    there = [each for each in medians if each is not None]
    return bool(there) and min(there) > 0 and max(there) >= WIDE * min(there)


def _above_zero(line: Line) -> Line:
    """Return the line for a logarithmic axis: zeros are left out, and the band ends at the least positive value."""
    least = min(each for part in (line.y, line.lower) for each in part if each)
    lower = tuple(None if each is None else max(each, least) for each in line.lower)
    y = tuple(each or None for each in line.y)
    return replace(line, y=y, lower=lower)


def _frame(there: Mapping[int, object]) -> tuple[float, float]:
    least, most = min(there, default=1), max(there, default=2)
    room = 0.02 * (most - least) or 0.5
    return least - room, most + room


def _limits(lines: Sequence[Line], *, logarithmic: bool) -> tuple[float, float]:
    found = [each for line in lines for part in (line.y, line.lower, line.upper) for each in part if each is not None]
    if logarithmic:
        above = [each for each in found if each > 0]
        return min(above) / 1.5, max(above) * 1.5
    return 0.0, limits([0.0, *found])[1] if found else 1.0


def _label(unit: str) -> str:
    shown = printable(unit)
    return f"Squared error (({shown})²)" if shown not in {"", "1"} else "Squared error"


def _caption(errors: Mapping[int, Errors], there: Mapping[int, Sequence[float]], *, each: bool) -> str:
    if not there:
        return ""
    counts = [len(found) for found in there.values()]
    band = "; band: from the first to the third quartile" if max(counts) > 1 else ""
    failed = sum(value is None for found in errors.values() for value in found.values())
    parts = [
        "Sum over the samples so far of the squared difference between fitness in simulation and in reality.",
        f"Median over {number_of('repetition', *counts)}{band}.",
    ]
    parts += ["Thin lines: single repetitions."] if each else []
    parts += [f"{number_of('value', failed)} left out, since the physics failed."] if failed else []
    return " ".join(parts)


def _alt(line: Line) -> str:
    if not line.x:
        return "Squared error of the best simulator over iterations: no results yet."
    ends = f"{number(line.y[0])} after iteration {line.x[0]} to {number(line.y[-1])} after iteration {line.x[-1]}"
    return f"Squared error of the best simulator over iterations: its median goes from {ends}."


def _table(line: Line, there: Mapping[int, Sequence[float]]) -> Table:
    rows = zip(there, line.y, line.lower, line.upper, map(len, there.values()), strict=True)
    return Table(
        ("Iteration", "Median", "First quartile", "Third quartile", "n"),
        tuple((str(at), number(middle), number(low), number(high), str(n)) for at, middle, low, high, n in rows),
    )
