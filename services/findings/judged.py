"""Curves as they are judged: at the number of evaluations where all are compared, and at their ends.

The end of a curve still rises, is flat since some number of real-world evaluations, or falls. The gain from a count j
to the last count T is paired: each repetition is compared with itself, so differences between repetitions do not hide
it. Its 95 % interval is Student's.

A curve is flat since k if, for every count j from k to T - 1, the interval of the mean gain from j to T contains 0, and
the interval of the gain from k ends below `SMALL` of the mean fitness at T. At least `FEWEST_EVALUATIONS` evaluations
must lie between k and T. The second condition is needed because an interval of few repetitions contains 0 whatever the
curve does. The intervals are not corrected for the number of starts: "since k" describes the curve, and is not a test.

Source: gaplab.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gaplab.schemas.curves import Curve, CurvePoint
from gaplab.schemas.records import ExperimentRead
from gaplab.schemas.reports import Trend
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.curves import curve_point
from gaplab.services.figures.words import distinct_names

FEWEST_REPETITIONS = 5
"""Repetitions below which nothing is said of a curve: the interval of two has nine standard deviations."""

FEWEST_EVALUATIONS = 3
"""Shortest end of a curve that is called flat, rising or falling."""

SMALL = 0.1
"""Share of the mean fitness below which a further gain is not worth real-world evaluations."""


@dataclass(frozen=True)
class CurveEnd:
    """What the end of a curve says; what too little is known of is None.

    Attributes:
        n: repetitions that have a value at both ends of the gain.
        last: the last count T.
        since: the count at which the gain begins.
        gain: mean gain from `since` to `last`.
        lower: lower end of its 95 % interval.
        upper: upper end of that interval.
    """

    trend: Trend
    n: int
    last: int
    since: int | None = None
    gain: float | None = None
    lower: float | None = None
    upper: float | None = None


def curve_end(recorded: FloatArray, last: int) -> CurveEnd:
    """Return the trend at the end of the curve with values `(r, k)` up to the count `last`; nan is a missing value."""
    n = int(np.isfinite(recorded[:, last]).sum())
    if n < FEWEST_REPETITIONS or last < FEWEST_EVALUATIONS:
        return CurveEnd(Trend.TOO_FEW, n, last)
    gains = [curve_point(start, recorded[:, last] - recorded[:, start]) for start in range(last)]
    latest = last - FEWEST_EVALUATIONS
    unsure = [gain.lower is not None and gain.upper is not None and gain.lower <= 0 <= gain.upper for gain in gains]
    without_gain = next((start + 1 for start in reversed(range(last)) if not unsure[start]), 0)
    starts = range(without_gain, latest + 1)
    limit = SMALL * abs(curve_point(last, recorded[:, last]).mean or 0.0)
    flat = next((start for start in starts if (gains[start].upper or 0.0) < limit), None)
    gain = gains[flat if flat is not None else min(without_gain, latest)]
    if gain.lower is None or gain.upper is None:
        return CurveEnd(Trend.TOO_FEW, gain.n, last)
    trend = Trend.FLAT if flat is not None else _direction(gain.lower, gain.upper)
    return CurveEnd(trend, gain.n, last, gain.evaluations, gain.mean, gain.lower, gain.upper)


def _direction(lower: float, upper: float) -> Trend:
    if lower > 0:
        return Trend.RISING
    return Trend.FALLING if upper < 0 else Trend.UNCLEAR


@dataclass(frozen=True)
class Judged:
    """A curve, and what a verdict needs of it.

    Attributes:
        name: its name, which no other curve has.
        end: the trend at its end; None without values.
        point: its point at the number of evaluations where all are compared, or its only one; None without values.
    """

    name: str
    curve: Curve
    end: CurveEnd | None
    point: CurvePoint | None

    @property
    def mean(self) -> float:
        """Mean fitness at that count; 0 without values."""
        return self.point.mean or 0.0 if self.point else 0.0


def recorded_of(curve: Curve) -> FloatArray:
    """Return the recorded fitness of a curve, `(repetitions, counts)`; nan is a missing value."""
    return np.array([point.values for point in curve.points], dtype=float).T if curve.points else np.empty((0, 0))


def judged_curves(
    curves: Sequence[Curve], experiments: Sequence[ExperimentRead], count: int | None
) -> tuple[Judged, ...]:
    """Return the curves of experiments with distinct names, trends, and points after `count` evaluations."""
    names = distinct_names([(one.name, one.strategy, one.study_name, one.experiment) for one in curves])
    found = zip(names, curves, experiments, strict=True)
    return tuple(_judged(name, curve, experiment, count) for name, curve, experiment in found)


def _judged(name: str, curve: Curve, experiment: ExperimentRead, count: int | None) -> Judged:
    last = None if curve.level or experiment.fitness is None else experiment.fitness.evaluations
    end = curve_end(recorded_of(curve), last) if last else None
    at = 0 if curve.level else count
    point = next((point for point in curve.points if point.evaluations == at and point.mean is not None), None)
    return Judged(name, curve, end, point)
