"""Recovery: whether 95 % intervals contain truths that were drawn, and which tunables motions identify at all.

Source: gaplab; simulation-based calibration, Talts et al. 2018, of intervals alone.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from gaplab.schemas.misfit import Identification
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.curves import CONFIDENCE
from gaplab.services.core.space import Space
from gaplab.services.findings.identification import Means, verdicts
from gaplab.services.findings.misfit import Doubt, Tuning, doubt, misfit_point
from gaplab.services.findings.tables import Grid
from gaplab.services.findings.wording import interval, listed, many, share

FEWEST = 20
"""Fewest draws of which a share means something: of 20 right intervals of 95 %, 17 or fewer hold in 2 of 100 cases."""


class Draw(NamedTuple):
    """A truth `(p,)`, and what was tuned: values, ends of intervals `(p, 2)`, and which tunables are called identified.

    `unreproduced` tells whether no simulator is said to reproduce the samples.
    """

    truth: FloatArray
    values: FloatArray
    intervals: FloatArray
    identified: tuple[bool, ...]
    unreproduced: bool


def drawn(truth: FloatArray, tuning: Tuning, names: Sequence[str], space: Space) -> Draw:
    """Return what a tuning with intervals found of a truth `(p,)`; names and bounds are those of the tunables."""
    assert tuning.interval is not None
    doubted = doubt([tuning], simulated=False)
    told = verdicts([misfit_point(0, [tuning], names, space)], [tuning.samples], Means(), doubted)
    identified = tuple(each.verdict is Identification.IDENTIFIED for each in told)
    return Draw(truth, tuning.parameters, tuning.interval, identified, doubted is Doubt.WRONG)


@dataclass(frozen=True)
class RecoveredTunable:
    """How often the intervals of a tunable contain the truth, and how much they say.

    Attributes:
        covered: share of the truths that are in their interval.
        interval: binomial 95 % interval of that share, Wilson's.
        width: median width of the intervals, as a share of the bounds.
        error: median distance of the value from the truth, likewise.
        identified: draws after which it is called identified.
        right: those of them whose truth is in its interval.
    """

    name: str
    covered: float
    interval: tuple[float, float]
    width: float
    error: float
    identified: int
    right: int

    @property
    def coverage(self) -> str:
        """The share that is covered, with its interval, in words."""
        return f"{share(self.covered)} ({interval(*self.interval, written=share)})"


def recovered(draws: Sequence[Draw], names: Sequence[str], space: Space) -> Iterator[RecoveredTunable]:
    """Yield how well each tunable, by its name and bounds, is recovered in draws, of which there is at least one."""
    for at, (name, extent) in enumerate(zip(names, space.extent.tolist(), strict=True)):
        truths, values = np.array([(each.truth[at], each.values[at]) for each in draws]).T
        lower, upper = np.array([each.intervals[at] for each in draws]).T
        inside, called = (lower <= truths) & (truths <= upper), np.array([each.identified[at] for each in draws])
        ends = scipy.stats.binomtest(int(inside.sum()), len(draws)).proportion_ci(CONFIDENCE, method="wilson")
        yield RecoveredTunable(
            name=name,
            covered=float(inside.mean()),
            interval=(float(ends.low), float(ends.high)),
            width=float(np.median(upper - lower) / extent),
            error=float(np.median(np.abs(values - truths)) / extent),
            identified=int(called.sum()),
            right=int((called & inside).sum()),
        )


def table(found: Sequence[RecoveredTunable], draws: int, samples: int) -> Grid:
    """Return a row for each tunable."""
    head = ("Tunable", "Truth in its interval", "Width", "Error", "Identified", "Right of these")
    rows = (
        (each.name, each.coverage, share(each.width), share(each.error), f"{each.identified}", f"{each.right}")
        for each in found
    )
    what = f"{many(draws, 'truth')}, each tuned on {many(samples, 'motion')}; width and error as shares of the bounds"
    return Grid(what, head, tuple(rows))


def sentences(found: Sequence[RecoveredTunable], draws: Sequence[Draw], samples: int) -> Iterator[str]:
    """Yield what the draws say: which tunables the motions identify, and whether to believe the intervals."""
    count, motions = len(draws), many(samples, "random motion")
    told = [f"{each.name} ({each.identified} of {many(count, 'draw')})" for each in found if each.identified]
    if told:
        yield f"Identified with {motions}: {listed(told)}."
    if never := [each.name for each in found if not each.identified]:
        yield f"Never identified with {motions}: {listed(never)}; other motions, more of them or other sensors may do."
    narrow = [each for each in found if each.interval[1] < CONFIDENCE]
    if count < FEWEST:
        yield f"{many(count, 'draw')} say little about how often intervals contain the truth; {FEWEST} or more do."
    elif not narrow:
        yield "The intervals contain the truth as often as they say, as far as the draws can tell."
    else:
        for each in narrow:
            yield f"Do not trust the intervals of {each.name}: they contain the truth in {each.coverage} of draws."
    if wrong := sum(each.unreproduced for each in draws):
        yield f"In {wrong} of {many(count, 'draw')}, no simulator is said to reproduce the samples."
