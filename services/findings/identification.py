"""Identification: which tunables the samples determine, which they do not, and what would help.

A tunable is as uncertain as its most uncertain sign says: the spread of best simulators over repetitions, the width of
the tuner's 95 % intervals, and the spread of its posterior, each over that of a uniform draw between the bounds.
Agreement is not truth: simulators that lack an effect agree on a value that makes up for it.

Source: gaplab.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from gaplab.schemas.misfit import Identification, MisfitPoint, TunableDistribution, TunableVerdict
from gaplab.services.findings import simulator_sentences as told
from gaplab.services.findings.misfit import OFTEN, Doubt
from gaplab.services.findings.wording import listed, share

FEWEST = 5
"""Fewest repetitions whose spread says something. Of five uniform draws, 1 % look identified; of three, 7 %."""

IDENTIFIED = 0.3
"""Largest remaining uncertainty of a tunable that is identified."""

PARTLY = 0.6
"""Largest remaining uncertainty of a tunable that is partly identified. One in ten draws of five spreads less."""

FALLING = 0.8
"""Share of its value at half the samples, or fewer, below which uncertainty still falls."""


@dataclass(frozen=True)
class Means:
    """Means to identify tunables that an experiment has not used.

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
        samples: number of samples that each was tuned on, with those from before; a mean over repetitions.
        means: what the experiment has not used.
        doubt: about the model; None without any.
    """
    tuned = [(point.tunables, count) for point, count in zip(points, samples, strict=True) if point.error.n]
    if not tuned:
        return ()
    latest, most = tuned[-1]
    earlier = [tunables for tunables, count in tuned if 2 * count <= most]
    halves = earlier[-1] if earlier else [None] * len(latest)
    found = tuple(_verdict(now, then, most, means) for now, then in zip(latest, halves, strict=True))
    return found if doubt is None else tuple(_doubted(each, doubt) for each in found)


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
        sentence=told.identified(now, verdict, left),
        helps=() if verdict is Identification.IDENTIFIED else tuple(_helps(now, then, samples, means)),
    )


def _doubted(found: TunableVerdict, doubt: Doubt) -> TunableVerdict:
    doubted = {Identification.IDENTIFIED, *([Identification.PARTLY] if doubt is Doubt.WRONG else [])}
    if found.verdict not in doubted:
        return found
    verdict = Identification.DOUBTFUL if doubt is Doubt.WRONG else Identification.PARTLY
    sentence = found.sentence.replace(found.verdict.value, f"{verdict.value}, for {doubt.value}", 1)
    return found.model_copy(update={"verdict": verdict, "sentence": sentence, "helps": (told.AGAINST[doubt],)})


def _judged(left: float | None) -> Identification:
    if left is None:
        return Identification.UNKNOWN
    if left <= IDENTIFIED:
        return Identification.IDENTIFIED
    return Identification.PARTLY if left <= PARTLY else Identification.NOT


def _helps(now: TunableDistribution, then: TunableDistribution | None, samples: float, means: Means) -> Iterator[str]:
    """Yield the means that would help to identify a tunable, the cheapest first.

    `then` is the tunable on at most half of the samples; None if there is no such iteration.
    """
    left, before = remaining(now), None if then is None else remaining(then)
    if left is None:
        yield told.REPETITIONS.format(FEWEST)
    if means.readings:
        yield told.READINGS.format(listed(means.readings, "or"))
    if left is None and means.intervals:
        yield told.INTERVALS.format(listed(means.intervals, "or"))
    if left is not None and before is not None and samples > 2:
        if left < FALLING * before:
            yield told.STILL_FALLING.format(share(before))
        else:
            yield told.OTHER_SAMPLES
    elif samples <= 2:
        yield told.MORE_SAMPLES
    if (now.at_lower or 0.0) + (now.at_upper or 0.0) >= OFTEN:
        yield told.WIDER_BOUNDS
