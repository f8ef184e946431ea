"""The error of the best simulator on the samples, over iterations: per sample, and as the sum that tuning minimises.

The sum grows with every sample, so it can rise while tuning gets better. The error per sample cannot mislead like that.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from statistics import median, quantiles

from gaplab.services.figures.marks import Axis, FigureDefinition, Line, Number, Panel, Table, faint_lines
from gaplab.services.figures.style import style_of
from gaplab.services.figures.words import drawable, heading, is_wide, limits, number, number_of, printable, with_unit

LOOK = style_of(0)

Errors = Mapping[int, Number]
"""Squared errors by repetition; None if the physics failed on a sample."""


Counts = Mapping[int, int]
"""Numbers of samples by repetition."""


@dataclass(frozen=True)
class ErrorKind:
    """The kind of error that was summed over samples.

    Attributes:
        unit: its unit.
        per_sample: returns the error, given the mean over samples of what was summed.
        squares: whether squares were summed.
        text: the error per sample, in words.
    """

    unit: str = ""
    per_sample: Callable[[float], float] = sqrt
    squares: bool = True
    text: str = "root mean square difference between fitness in simulation and in reality"


DEFAULT = ErrorKind()


@dataclass(frozen=True)
class _Measure:
    """One measure of the error, named with its unit: its median and quartiles, and the known values by iteration."""

    name: str
    line: Line
    values: Mapping[int, Sequence[float]]
    panel: Panel


def squared_error_figure(
    errors: Mapping[int, Errors],
    kind: ErrorKind = DEFAULT,
    *,
    samples: Mapping[int, Counts] | None = None,
    title: str = "",
    each: bool = False,
) -> FigureDefinition:
    """Return a figure of median and quartiles of the error after each iteration with tuning.

    One panel has the error per sample, if the numbers of samples are given; the other has the sum that tuning
    minimises. Errors are sums by iteration; those too large to compute with are left out. `each` adds a thin line for
    every repetition.
    """
    errors = {at: {one: drawable(value) for one, value in found.items()} for at, found in errors.items()}
    unit = printable(kind.unit)
    square = f"({unit})²" if unit not in {"", "1"} else ""
    measures = [_measure(errors, summed(squares=kind.squares), "Sum", square if kind.squares else unit, each=each)]
    if samples:
        per_sample = _per_sample(errors, samples, kind)
        measures.insert(0, _measure(per_sample, "Error per sample", "Per sample", unit, each=each))
    return FigureDefinition(
        name="squared-error",
        title=heading(title),
        panels=tuple(measure.panel for measure in measures),
        caption=_caption(errors, measures, kind, each=each),
        alt=_alt(measures),
        share_x=True,
        table=_table(measures),
    )


def summed(*, squares: bool) -> str:
    """Return the name of the sum that tuning minimises."""
    return "Sum of squared errors" if squares else "Sum of errors"


def _per_sample(
    errors: Mapping[int, Errors], samples: Mapping[int, Counts], kind: ErrorKind
) -> dict[int, dict[int, Number]]:
    return {
        at: {
            repetition: None if value is None else kind.per_sample(value / samples[at][repetition])
            for repetition, value in found.items()
            if samples.get(at, {}).get(repetition)
        }
        for at, found in errors.items()
    }


def _measure(errors: Mapping[int, Errors], name: str, label: str, unit: str, *, each: bool) -> _Measure:
    there = {at: [value for value in found.values() if value is not None] for at, found in sorted(errors.items())}
    there = {at: found for at, found in there.items() if found}
    line = _median(there)
    logarithmic = is_wide(line.y)
    marks = (line, *([_repetitions(errors)] if each else [])) if there else ()
    before = ", without those from before" if 0 in there else ""
    panel = Panel(
        tuple(_above_zero(mark) for mark in marks) if logarithmic else marks,
        Axis(f"Iteration (real-world evaluations so far{before})", _frame(there), whole=True),
        Axis(with_unit(label, {unit}), _limits(marks, logarithmic=logarithmic), log=logarithmic),
        title=name,
    )
    return _Measure(with_unit(name, {unit}), line, there, panel)


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


def _caption(errors: Mapping[int, Errors], measures: Sequence[_Measure], kind: ErrorKind, *, each: bool) -> str:
    there = measures[-1].values
    if not there:
        return ""
    counts = [len(found) for found in there.values()]
    band = "; band: from the first to the third quartile" if max(counts) > 1 else ""
    failed = sum(value is None for found in errors.values() for value in found.values())
    parts = [f"Error per sample: {kind.text}."] if len(measures) > 1 else []
    parts += [
        f"The sum of {'squared errors' if kind.squares else 'errors'} over the samples so far grows with their number.",
        f"Median over {number_of('repetition', *counts)}{band}.",
    ]
    parts += ["Thin lines: single repetitions."] if each else []
    parts += [f"{number_of('value', failed)} left out, since the physics failed."] if failed else []
    logarithmic = any(measure.panel.y.log for measure in measures)
    zeros = logarithmic and any(value == 0 for found in there.values() for value in found)
    parts += ["Errors of 0 are left out of a logarithmic axis."] if zeros else []
    return " ".join(parts)


def _alt(measures: Sequence[_Measure]) -> str:
    if not measures[-1].line.x:
        return "Error of the best simulator over iterations: no results yet."
    told = [f"{measure.name.lower()}: {_ends(measure.line)}" for measure in measures if measure.line.x]
    return f"Error of the best simulator over iterations; the median goes from: {'; '.join(told)}."


def _ends(line: Line) -> str:
    return f"{number(line.y[0])} after iteration {line.x[0]} to {number(line.y[-1])} after iteration {line.x[-1]}"


def _table(measures: Sequence[_Measure]) -> Table:
    """Return the table: quartiles of the error per sample, then of the sum, then the number of repetitions."""
    heads = [f"{measure.name}, {which}" for measure in measures for which in ("median", "quartile 1", "quartile 3")]
    rows = {str(at): [str(len(found))] for at, found in measures[-1].values.items()}
    for measure in reversed(measures):
        line = measure.line
        for at, *quartiles in zip(measure.values, line.y, line.lower, line.upper, strict=True):
            rows[str(at)][:0] = map(number, quartiles)
    return Table(("Iteration", *heads, "n"), tuple((at, *cells) for at, cells in rows.items()))
