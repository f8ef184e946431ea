"""Identification: which tunables the samples determine, which they do not, and what would help.

A tunable is as uncertain as its most uncertain sign says: the spread of best simulators over repetitions, the width of
the tuner's 95 % intervals, and the spread of its posterior, each over that of a uniform draw between the bounds.
Agreement is not truth: simulators that lack an effect agree on a value that makes up for it.

Source: gaplab.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

from gaplab.schemas.misfit import Identification, MisfitPoint, TunableDistribution, TunableVerdict
from gaplab.services.core.misfit import OFTEN

FEWEST = 5
"""Fewest repetitions whose spread says something. Of five uniform draws, 1 % look identified; of three, 7 %."""

IDENTIFIED = 0.3
"""Largest remaining uncertainty of a tunable that is identified."""

PARTLY = 0.6
"""Largest remaining uncertainty of a tunable that is partly identified. One in ten draws of five spreads less."""

FALLING = 0.8
"""Share of its value at half the samples, or fewer, below which uncertainty still falls."""

OVERFITTED = 2.0
"""Error on held-out samples, over that on the samples tuned on, from which simulators are overfitted."""


class Doubt(Enum):
    """Why agreement may not be truth, in words."""

    WRONG = "for no simulator reproduces the samples"
    SOME = "for the samples raise some doubt about the model"
    UNTESTED = "for nothing tells noise from a wrong model"


HELPS = {
    Doubt.WRONG: "a tunable for what the model lacks",
    Doubt.SOME: "more samples, or a tunable for what the model lacks",
    Doubt.UNTESTED: "repeats of a measurement, or the discrepancy readings",
}


@dataclass(frozen=True)
class Means:
    """What an experiment has not used, which may help.

    Attributes:
        readings: discrepancies that compare readings which the robot has, and tuning ignores.
        intervals: tuners that give intervals, if the experiment's gives none.
    """

    readings: Sequence[str] = ()
    intervals: Sequence[str] = ()


def verdicts(
    points: Sequence[MisfitPoint], samples: Sequence[float], means: Means, doubt: Doubt | None = None
) -> tuple[TunableVerdict, ...]:
    """Return the verdict on each tunable at the latest iteration; none before the first sample.

    Args:
        points: misfit of each iteration, from 0.
        samples: number of samples that each was tuned on, with those from before the experiment; a mean over
            repetitions.
        means: what the experiment has not used.
        doubt: about the model; None without any.
    """
    tuned = [(point.tunables, count) for point, count in zip(points, samples, strict=True) if point.error.n]
    if not tuned:
        return ()
    latest, most = tuned[-1]
    earlier = [tunables for tunables, count in tuned if 2 * count <= most]
    halves = earlier[-1] if earlier else [None] * len(latest)
    told = tuple(_verdict(now, then, most, means) for now, then in zip(latest, halves, strict=True))
    return told if doubt is None else tuple(_doubted(each, doubt) for each in told)


def overfitting(point: MisfitPoint, unit: str) -> str:
    """Return the error on held-out samples beside that on the others, in a sentence; "" without held-out samples."""
    new, old = point.held_out_error.mean, point.error.mean
    if new is None or old is None:
        return ""
    found = f"on held-out samples the best simulators err by {new:.2g} {unit}, on those tuned on by {old:.2g}"
    return f"{found}: they fit their samples better than new ones" if new > OVERFITTED * old else found


def remaining(found: TunableDistribution) -> float | None:
    """Return the share of the uncertainty before any sample that is left, at most 1; None if nothing says it.

    Values at both bounds spread more than uniform draws. That is as uncertain as before, not more.
    """
    spread = found.spread if found.n >= FEWEST else None
    known = [min(each, 1.0) for each in (spread, found.interval, found.posterior) if each is not None]
    return max(known, default=None)


def _verdict(
    now: TunableDistribution, then: TunableDistribution | None, samples: float, means: Means
) -> TunableVerdict:
    left = remaining(now)
    verdict = _judged(left)
    return TunableVerdict(
        name=now.name,
        verdict=verdict,
        remaining=left,
        sentence=_sentence(now, verdict, left),
        helps=() if verdict is Identification.IDENTIFIED else tuple(_helps(now, then, samples, means)),
    )


def _doubted(found: TunableVerdict, doubt: Doubt) -> TunableVerdict:
    doubted = {Identification.IDENTIFIED, *([Identification.PARTLY] if doubt is Doubt.WRONG else [])}
    if found.verdict not in doubted:
        return found
    verdict = Identification.DOUBTFUL if doubt is Doubt.WRONG else Identification.PARTLY
    sentence = found.sentence.replace(found.verdict.value, f"{verdict.value}, {doubt.value}", 1)
    return found.model_copy(update={"verdict": verdict, "sentence": sentence, "helps": (HELPS[doubt],)})


def _judged(left: float | None) -> Identification:
    if left is None:
        return Identification.UNKNOWN
    if left <= IDENTIFIED:
        return Identification.IDENTIFIED
    return Identification.PARTLY if left <= PARTLY else Identification.NOT


def _sentence(now: TunableDistribution, verdict: Identification, left: float | None) -> str:
    repetitions = f"{now.n} repetition{'s' if now.n != 1 else ''}"
    if left is None:
        few = f"{repetitions} {'is' if now.n == 1 else 'are'} too few to compare"
        return f"{now.name}: unknown, for {few}, and the tuner gives no intervals"
    deviation = f" \N{PLUS-MINUS SIGN} {now.sd:.2g}" if now.sd is not None else ""
    value = f"{now.mean:.2g}{deviation} over {repetitions}"
    return f"{now.name}: {verdict.value}; {value}, with {100 * left:.0f} % of the uncertainty before any sample"


def _helps(now: TunableDistribution, then: TunableDistribution | None, samples: float, means: Means) -> Iterator[str]:
    """Yield what would help, what costs least first.

    Args:
        now: the tunable at the latest iteration.
        then: the same on at most half of the samples; None if there is no such iteration.
        samples: number of samples.
        means: what the experiment has not used.
    """
    left, before = remaining(now), None if then is None else remaining(then)
    if left is None:
        yield f"at least {FEWEST} repetitions"
    if means.readings:
        yield f"the discrepancy {' or '.join(means.readings)}: a fitness is one number a sample, sensors say more"
    if left is None and means.intervals:
        yield f"a tuner with intervals: {' or '.join(means.intervals)}"
    if left is not None and before is not None and samples > 2:
        if left < FALLING * before:
            yield f"more samples: {100 * before:.0f} % were left at half of them"
        else:
            yield "another strategy, or a fixed value: more samples of this kind have not helped"
    elif samples <= 2:
        yield "more samples"
    if (now.at_lower or 0.0) + (now.at_upper or 0.0) >= OFTEN:
        yield "wider bounds, if they make sense: it often ends at one"
