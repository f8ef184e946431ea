"""Where recorded fitness comes from: samples, transferred controllers, and the distance of simulators from the truth.

The recorded fitness is the larger of two: that of the transferred controller, and that of the best sample so far. A
strategy may therefore lead because its simulators are better, or because its samples are fit.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from benchmarks.findings import found
from benchmarks.reproduction import paper, statements
from benchmarks.reproduction.curves import NEARER_TO_A_THIRD
from benchmarks.reproduction.reading import samples_of
from benchmarks.reproduction.studies import Study
from benchmarks.reproduction.tables import best_of, distance
from gaplab.services.core.arrays import FloatArray
from gaplab.services.figures.words import spoken
from gaplab.services.reports.numbers import MISSING
from gaplab.services.store.session import Store

COUNTS = (1, 3, 10)
FIRST = 3
"""Samples from which on the paper compares the strategies."""

WORDS = (
    "## Where the recorded fitness comes from\n\nThe recorded fitness is the larger of two: that of the transferred "
    "controller, and that of the best sample so far. So a strategy may lead because its simulators are better, or "
    "because its samples are fit. The tables have mean fitness in reality, as a ratio to direct; the share of "
    "repetitions whose recorded fitness is a sample's; and the median Euclidean distance of the best simulators from "
    "the truth, with the bounds of each tunable scaled to 1. The paper says of itself that beyond three or four "
    'samples "the algorithm is hardly tuning the simulator anymore, instead just searching for fitter samples", '
    "because its simulators are nearly perfect by then. A coefficient that matters little to fitness can make the "
    "distance large, although the simulator does well."
)
GROUPS = paper.SIMULATED_FIT, paper.WEAK
HEAD = ("strategy", "samples", "last sample", "best sample", "transferred", "recorded", "from a sample", "distance")


def rows(store: Store, study: Study) -> Iterator[tuple[str, ...]]:
    """Yield a row for each strategy and number of samples; fitness is over direct.

    The columns are means over repetitions: fitness in reality of the last sample, of the best so far, of the
    transferred controller, and the recorded one; the share of repetitions whose recorded fitness is a sample's; and the
    median distance of the best simulators from the truth.
    """
    for arm in (own for name in study.present if (own := study.arm(name))):
        away = found(store, arm.read.id)
        samples, probed = samples_of(store, arm), arm.transferred
        best = np.fmax.accumulate(samples, axis=1)
        for count in (each for each in COUNTS if each <= arm.last):
            columns = (fitness[:, count] / study.unit for fitness in (samples, best, probed, arm.recorded))
            from_sample = best[:, count] > np.nan_to_num(probed[:, count], nan=-np.inf)
            known = np.isfinite(arm.recorded[:, count])
            share = f"{from_sample[known].mean():.0%}" if known.any() else MISSING
            yield spoken(arm.strategy), str(count), *map(_mean, columns), share, distance(away.get(count))


def lead(study: Study) -> str:
    """Return in sentences what simulated fit gains, in transferred controllers alone and in recorded fitness.

    Each repetition is one value, and each strategy counts alike. Empty if the study lacks one of both groups.
    """
    if study.last < FIRST:
        return ""
    told = [
        _lead(study, span, transferred_only=transferred_only)
        for span in ((FIRST, study.last), (study.last, study.last))
        for transferred_only in (True, False)
    ]
    if not all(told):
        return ""
    return (
        f"Over {FIRST} to {study.last} samples, strategies with simulated fit lead the others by {told[0]} of direct "
        f"in transferred controllers alone, and by {told[1]} in recorded fitness; after {study.last}, by {told[2]} and "
        f"{told[3]}.{_spread(study)}{_searched_as_often(study)}"
    )


def _spread(study: Study) -> str:
    """Return in a sentence how much strategies with simulated fit vary beside the others, in both kinds of fitness."""
    told = []
    for transferred_only in (True, False):
        narrow, wide = (_over(study, names, (FIRST, study.last), transferred_only=transferred_only) for names in GROUPS)
        if min(map(len, [*narrow, *wide])) < 2:
            return ""
        told.append(statements.narrower(narrow, wide, NEARER_TO_A_THIRD, 1 / paper.LEAST_TIMES).estimate)
    return (
        f" Over {FIRST} to {study.last}, their standard deviations are {told[0]} times the others' in transferred "
        f"controllers alone, and {told[1]} times in recorded fitness."
    )


def _searched_as_often(study: Study) -> str:
    """Return in a sentence what the best of several direct searches has, if direct has enough repetitions."""
    best = best_of(study)
    if len(best) <= study.last:
        return ""
    few, many = (f"{count} + 1 direct searches has {best[count]}" for count in (FIRST, study.last))
    return f" The best of {few}, and the best of {many}."


def _lead(study: Study, span: tuple[int, int], *, transferred_only: bool) -> str:
    """Return the difference with its interval; the repetitions are those with both values at all its samples."""
    firsts, seconds = (
        [group.mean(axis=1) for group in _over(study, names, span, transferred_only=transferred_only)]
        for names in GROUPS
    )
    return statements.contrast(firsts, seconds, study.unit) if firsts and seconds else ""


def _over(study: Study, names: Iterable[str], span: tuple[int, int], *, transferred_only: bool) -> list[FloatArray]:
    """Return the values `(r, k)` of each strategy in the repetitions that have both kinds of fitness throughout."""
    columns = slice(span[0], span[1] + 1)
    found = []
    for arm in (own for name in names if (own := study.arm(name))):
        there = np.isfinite(arm.recorded[:, columns] + arm.transferred[:, columns]).all(axis=1)
        found.append((arm.transferred if transferred_only else arm.recorded)[there, columns])
    return found


def _mean(values: FloatArray) -> str:
    return f"{np.nanmean(values):.2f}" if np.isfinite(values).any() else MISSING
