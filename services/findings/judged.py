"""Curves as they are judged: at the count where all are compared, and at their ends."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gaplab.schemas.records import ExperimentRead
from gaplab.schemas.results import Curve, CurvePoint
from gaplab.services.core.arrays import FloatArray
from gaplab.services.figures.words import distinct_names
from gaplab.services.findings.trends import CurveEnd, curve_end


@dataclass(frozen=True)
class Judged:
    """One curve as it is judged.

    Attributes:
        name: its name among the others.
        curve: the curve.
        end: what its end says; None without values.
        point: its values at the count where all are compared, or of a level; None without values.
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
    rows = [[np.nan if value is None else value for value in point.values] for point in curve.points]
    return np.array(rows, dtype=float).T if rows else np.empty((0, 0))


def judged_curves(
    curves: Sequence[Curve], experiments: Sequence[ExperimentRead], count: int | None
) -> tuple[Judged, ...]:
    """Return the curves of experiments with their distinct names, their ends, and their points at the common count."""
    names = distinct_names([(curve.name, curve.strategy, curve.experiment) for curve in curves])
    found = zip(names, curves, experiments, strict=True)
    return tuple(_judged(name, curve, experiment, count) for name, curve, experiment in found)


def _judged(name: str, curve: Curve, experiment: ExperimentRead, count: int | None) -> Judged:
    last = None if curve.level or experiment.fitness is None else experiment.fitness.evaluations
    end = curve_end(recorded_of(curve), last) if last else None
    at = 0 if curve.level else count
    point = next((point for point in curve.points if point.evaluations == at and point.mean is not None), None)
    return Judged(name, curve, end, point)
