"""Where recorded fitness comes from: samples, transferred controllers, and the distance of simulators from the truth.

The recorded fitness is the larger of two: that of the transferred controller, and that of the best sample so far. A
strategy may therefore lead because its simulators are better, or because its samples are fit.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks.findings import found
from benchmarks.reproduction import paper, statements
from benchmarks.reproduction.studies import Arm, Study, measured
from benchmarks.reproduction.tables import best_of, distance
from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.arrays import FloatArray
from gaplab.services.figures.words import spoken
from gaplab.services.reports.numbers import MISSING
from gaplab.services.store.session import Store

COUNTS = (1, 3, 10)
FIRST = 3
"""Samples from which on the paper compares the strategies."""

HEAD = ("strategy", "samples", "last sample", "best sample", "transferred", "recorded", "from a sample", "distance")


def rows(store: Store, study: Study) -> Iterator[tuple[str, ...]]:
    """Yield a row for each strategy and number of samples; fitness is over direct.

    The columns are means over repetitions: fitness in reality of the last sample, of the best so far, of the
    transferred controller, and the recorded one; the share of repetitions whose recorded fitness is a sample's; and the
    median distance of the best simulators from the truth.
    """
    for arm in (own for name in study.present if (own := study.arm(name))):
        away = found(store, arm.read.id)
        samples, probed = (measured(store, arm, kind) for kind in (MeasurementKind.SAMPLE, MeasurementKind.PROBE))
        best = np.fmax.accumulate(samples, axis=1)
        for count in (each for each in COUNTS if each <= arm.last):
            columns = (fitness[:, count] / study.unit for fitness in (samples, best, probed, arm.recorded))
            from_sample = best[:, count] > np.nan_to_num(probed[:, count], nan=-np.inf)
            known = np.isfinite(arm.recorded[:, count])
            share = f"{from_sample[known].mean():.0%}" if known.any() else MISSING
            yield spoken(arm.strategy), str(count), *map(_mean, columns), share, distance(away.get(count))


def lead(store: Store, study: Study) -> str:
    """Return in a sentence what simulated fit gains, in transferred controllers alone and in recorded fitness.

    Each repetition is one value, and each strategy counts alike. Empty if the study lacks one of both groups.
    """
    if study.last < FIRST:
        return ""
    spans = [(FIRST, study.last), (study.last, study.last)]
    told = [
        _lead(store, study, span, transferred_only=transferred_only)
        for span in spans
        for transferred_only in (True, False)
    ]
    if not all(told):
        return ""
    return (
        f"Over {FIRST} to {study.last} samples, strategies with simulated fit lead the others by {told[0]} of direct "
        f"in transferred controllers alone, and by {told[1]} in recorded fitness; after {study.last}, by {told[2]} and "
        f"{told[3]}.{_searched_as_often(study)}"
    )


def _searched_as_often(study: Study) -> str:
    """Return in a sentence what the best of several direct searches has, if direct has enough repetitions."""
    best = best_of(study)
    if len(best) <= study.last:
        return ""
    sizes = FIRST + 1, study.last + 1
    return (
        f" The best of {sizes[0]} direct searches has {best[FIRST]}, and the best of {sizes[1]} has {best[study.last]}."
    )


def _lead(store: Store, study: Study, span: tuple[int, int], *, transferred_only: bool) -> str:
    """Return the difference with its interval; the repetitions are those with both values at all its samples."""
    sides = [
        [
            _over(store, arm, span, transferred_only=transferred_only)
            for name in names
            if (arm := study.arm(name)) is not None
        ]
        for names in (paper.SIMULATED_FIT, paper.WEAK)
    ]
    return statements.contrast(sides[0], sides[1], study.unit) if all(sides) else ""


def _over(store: Store, arm: Arm, span: tuple[int, int], *, transferred_only: bool) -> FloatArray:
    probed = measured(store, arm, MeasurementKind.PROBE)
    columns = slice(span[0], span[1] + 1)
    there = np.isfinite(arm.recorded[:, columns] + probed[:, columns]).all(axis=1)
    chosen = probed if transferred_only else arm.recorded
    means: FloatArray = chosen[there, columns].mean(axis=1)
    return means


def _mean(values: FloatArray) -> str:
    return f"{np.nanmean(values):.2f}" if np.isfinite(values).any() else MISSING
