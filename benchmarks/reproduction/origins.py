"""Where recorded fitness comes from: samples, transferred controllers, and the distance of simulators from the truth.

The recorded fitness is the larger of two: that of the transferred controller, and that of the best sample so far. A
strategy may therefore lead because its simulators are better, or because its samples are fit.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks.findings import found
from benchmarks.reproduction import paper, statements
from benchmarks.reproduction.studies import Arm, Study
from benchmarks.reproduction.tables import distance
from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.statistics import finite
from gaplab.services.figures.words import spoken
from gaplab.services.reports.numbers import MISSING
from gaplab.services.store.models import MeasurementRow, RepetitionRow
from gaplab.services.store.queries.repetition_rows import of_experiments
from gaplab.services.store.session import Session, Store

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
        with store.reading() as session:
            samples, transferred = (
                _fitnesses(session, arm, kind) for kind in (MeasurementKind.SAMPLE, MeasurementKind.PROBE)
            )
        best = np.fmax.accumulate(samples, axis=1)
        for count in (each for each in COUNTS if each <= arm.last):
            columns = (fitness[:, count] / study.unit for fitness in (samples, best, transferred, arm.recorded))
            from_sample = best[:, count] > np.nan_to_num(transferred[:, count], nan=-np.inf)
            known = np.isfinite(arm.recorded[:, count])
            share = f"{from_sample[known].mean():.0%}" if known.any() else MISSING
            yield spoken(arm.strategy), str(count), *map(_mean, columns), share, distance(away.get(count))


def lead(store: Store, study: Study) -> str:
    """Return in a sentence what simulated fit gains, in transferred controllers alone and in recorded fitness.

    Each repetition is one value, its mean from `FIRST` samples on. Empty if the study lacks one of both groups.
    """
    if study.last < FIRST:
        return ""
    transferred, recorded = (
        [
            [values for name in names if (arm := study.arm(name)) for values in _late(store, arm, only=only)]
            for names in (paper.SIMULATED_FIT, paper.WEAK)
        ]
        for only in (True, False)
    )
    if not all((*transferred, *recorded)):
        return ""
    told = [statements.estimate(np.array(fit), np.array(weak), study.unit) for fit, weak in (transferred, recorded)]
    return (
        f"Over {FIRST} to {study.last} samples, strategies with simulated fit lead the others by {told[0]} of direct "
        f"in transferred controllers alone, and by {told[1]} in recorded fitness."
    )


def _late(store: Store, arm: Arm, *, only: bool) -> FloatArray:
    """Return a value for each complete repetition: its recorded fitness, or that of transferred controllers only."""
    values = arm.recorded
    if only:
        with store.reading() as session:
            values = _fitnesses(session, arm, MeasurementKind.PROBE)
    return finite(values[:, FIRST:].mean(axis=1))


def _fitnesses(session: Session, arm: Arm, kind: MeasurementKind) -> FloatArray:
    """Return measured fitness `(r, k)` by repetition and number of samples; nan if it failed or is missing."""
    row = MeasurementRow
    values = np.full(arm.recorded.shape, np.nan)
    query = of_experiments(row, [arm.read.id], RepetitionRow.number, row.iteration, row.fitness)
    for repetition, iteration, fitness in session.execute(query.where(row.kind == kind, row.fitness.is_not(None))):
        values[repetition, iteration] = fitness
    return values


def _mean(values: FloatArray) -> str:
    return f"{np.nanmean(values):.2f}" if np.isfinite(values).any() else MISSING
