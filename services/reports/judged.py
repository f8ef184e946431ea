"""Curves as they are judged: at the count where all are compared, and at their ends."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gaplab.schemas.curves import Comparison, Curve, CurvePoint
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.trends import CurveEnd, curve_end, last_count
from gaplab.services.figures.words import distinct_names

SIGNIFICANT = 0.05


@dataclass(frozen=True)
class Judged:
    """One curve as it is judged.

    Attributes:
        name: its name among the others.
        curve: the curve.
        end: what its end says; None without values.
        point: its values at the count where all are compared, or of the direct baseline; None without values.
    """

    name: str
    curve: Curve
    end: CurveEnd | None
    point: CurvePoint | None

    @property
    def mean(self) -> float:
        """Mean fitness at that count; 0 without values."""
        return self.point.mean or 0.0 if self.point else 0.0


def common_count(curves: Sequence[Curve]) -> int | None:
    """Return the number of evaluations that at least half of the repetitions of every curve have reached.

    None without values. The direct baseline has no evaluations, and a curve without values limits no other.
    """
    counts = [last_count(recorded_of(curve)) for curve in curves if not curve.direct]
    return min((count for count in counts if count is not None), default=None)


def recorded_of(curve: Curve) -> FloatArray:
    """Return the recorded fitness of a curve, `(repetitions, counts)`; nan is a missing value."""
    rows = [[np.nan if value is None else value for value in point.values] for point in curve.points]
    return np.array(rows, dtype=float).T if rows else np.empty((0, 0))


def judged_curves(curves: Sequence[Curve], count: int | None) -> tuple[Judged, ...]:
    """Return the curves with their distinct names, their ends, and their points at the common count."""
    names = distinct_names([(curve.name, curve.experiment) for curve in curves])
    return tuple(_judged(name, curve, count) for name, curve in zip(names, curves, strict=True))


def differs(pair: Comparison) -> bool:
    """Return whether a pair differs significantly, by Student's t after Holm's correction."""
    return (p := p_of(pair)) is not None and p < SIGNIFICANT


def p_of(pair: Comparison) -> float | None:
    """Return p of Student's t, corrected by Holm's method; None if undefined."""
    return pair.student.p_holm if pair.student.p_holm is not None else pair.student.p


def _judged(name: str, curve: Curve, count: int | None) -> Judged:
    recorded = recorded_of(curve)
    last = None if curve.direct else last_count(recorded)
    at = 0 if curve.direct else count
    point = next((point for point in curve.points if point.evaluations == at and point.mean is not None), None)
    return Judged(name, curve, None if last is None else curve_end(recorded, last), point)
