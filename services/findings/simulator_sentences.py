"""The sentences about tuned simulators: their misfit, what they do not reproduce, and which tunables are identified."""

from collections.abc import Iterator, Sequence

import numpy as np

from gaplab.schemas.curves import from_before
from gaplab.schemas.misfit import Identification, MisfitPoint, TunableDistribution
from gaplab.services.core.linear_models import SURPRISING
from gaplab.services.findings.misfit import OFTEN, Doubt, SensorError, Tuning, sensor_errors, surprise
from gaplab.services.findings.wording import many, number, share, spread
from gaplab.services.world.sensing import Sensors

LACKING = (
    "Often missing in a model: the height or slope of the ground, a weak or slow motor, mass, delay; or a tunable is "
    "at its bound"
)

SHOWN = 2
"""Sensors that are named, those with the largest differences."""

OVERFITTED = 2.0
"""Error on held-out samples, over that on the samples tuned on, from which simulators are overfitted."""

IDENTIFIED_NOTE = (
    "100 % is as uncertain as before any sample. The largest counts of the spread over repetitions, the tuner's 95 % "
    "intervals, and its posterior. Agreement is not truth: simulators that lack an effect agree on a value that makes "
    "up for it."
)

AGAINST = {
    Doubt.WRONG: "a tunable for what the model lacks",
    Doubt.SOME: "more samples, or a tunable for what the model lacks",
    Doubt.UNTESTED: "repeats of a measurement, or the discrepancy readings",
}
"""What helps against a doubt about the model."""

REPETITIONS = "at least {} repetitions"
READINGS = "the discrepancy {}: a fitness is one number a sample, sensors say more"
INTERVALS = "a tuner with intervals: {}"
MORE_SAMPLES = "more samples"
STILL_FALLING = "more samples: {} were left at half of them"
OTHER_SAMPLES = "another strategy, or a fixed value: more samples of this kind have not helped"
WIDER_BOUNDS = "wider bounds, if they make sense: it often ends at one"


def remarks(points: Sequence[MisfitPoint], unit: str, error_unit: str | None = None, known: int = 0) -> tuple[str, ...]:
    """Return the latest point that has an error in sentences; none before the first sample.

    The unit of errors is by default that of fitness; `known` samples are from before the experiment.
    """
    with_error = [each for each in points if each.error.n]
    if not with_error:
        return ()
    last, first = with_error[-1], points[0]
    at_bounds = [sentence for each in last.tunables for sentence in _at_bounds(each)]
    left = _left(last, unit if error_unit is None else error_unit, known)
    return (left, *_gaps(first, last, unit), *at_bounds)


def overfitting(point: MisfitPoint, unit: str) -> str:
    """Return the error on held-out samples beside that on the others; "" without held-out samples."""
    new, old = point.held_out_error.mean, point.error.mean
    if new is None or old is None:
        return ""
    found = f"on held-out samples the best simulators err by {number(new, 2)} {unit}, on those tuned on by"
    worse = ": they fit their samples better than new ones" if new > OVERFITTED * old else ""
    return f"{found} {number(old, 2)}{worse}"


def from_earlier(tuned_on: int, held_out: int, *, recorded: bool = False) -> str:
    """Return how many samples from before the experiment, or recordings, there are; "" without any."""
    counts = ((tuned_on, "tuned on"), (held_out, "held out"))
    told = ", ".join(f"{count} {what}" for count, what in counts if count)
    return f"{'recordings' if recorded else 'samples from before the experiment'}: {told}" if told else ""


def unreproduced(id: str, tunings: Sequence[Tuning], sensors: Sensors | None, unit: str) -> str:
    """Return that no simulator reproduces the samples of an experiment, with numbers; "" if one does, or nobody knows.

    `tunings` are the latest of each repetition, `sensors` those of the robot, if they are known.
    """
    found = surprise(tunings)
    if found is None or found > SURPRISING:
        return ""
    fits = [each.fit for each in tunings if each.fit is not None]
    said = sum(fit.surprise <= SURPRISING for fit in fits)
    error = float(np.nanmean([each.error for each in tunings if each.fit is not None]))
    left = float(np.nanmean([each.expected for each in tunings if each.fit is not None]))
    of = f"{said} of {len(fits)} repetitions say so" if len(fits) > 1 else "by one repetition"
    worst = [_sensor(each) for each in sensor_errors(fits, sensors)[:SHOWN]]
    where = f"; most differs {', then '.join(worst)}" if worst else ""
    return (
        f"{Doubt.WRONG.value}: the best err by {number(error, 2)} {unit} a sample, where noise and rough physics would "
        f"leave {number(left, 2)} ({of}){where}. {LACKING}. In a service, `gaplab try-tunables {id}` tries "
        "further tunables, and `search`"
    )


def identified(now: TunableDistribution, verdict: Identification, left: float | None) -> str:
    """Return a verdict on a tunable, with its values and the share of the uncertainty that is left."""
    repetitions = many(now.n, "repetition")
    if left is None:
        few = f"{repetitions} {'is' if now.n == 1 else 'are'} too few to compare"
        return f"{now.name}: unknown, for {few}, and the tuner gives no intervals"
    value = spread(now.mean, now.sd, 2) + (f" over {repetitions}" if now.n > 1 else "")
    return f"{now.name}: {verdict.value}; {value}, with {share(left)} of the uncertainty before any sample"


def noise(sd: float, unit: str) -> str:
    """Return how much repeats of one measurement differ."""
    of = f" {unit}" if unit else ""
    return f"Repeats of one measurement differ by {number(sd)}{of} (standard deviation, pooled)."


def _left(point: MisfitPoint, unit: str, known: int) -> str:
    error = point.error
    counted = f"{many(point.iteration, 'real-world evaluation')}{from_before(known)}"
    left = f"{number(error.mean, 2)} {unit} a sample"
    if error.n == 1:
        return f"at {counted} the best simulator errs by {left}"
    deviation = f"SD {number(error.sd, 2)}, " if error.sd is not None else ""
    ends = f"{number(error.least, 2)} to {number(error.greatest, 2)} over {error.n} repetitions"
    return f"at {counted} the best simulators err by {left} ({deviation}{ends})"


def _gaps(first: MisfitPoint, last: MisfitPoint, unit: str) -> tuple[str, ...]:
    if last.gap.mean is None:
        return ()
    has_before = first.gap.mean is not None and not first.error.n
    before = f", and by {number(first.gap.mean, 2)} before tuning" if has_before else ""
    return (f"the controller evolved in them differs by {number(last.gap.mean, 2)} {unit} in reality{before}",)


def _at_bounds(tuned: TunableDistribution) -> Iterator[str]:
    sides = (("lower", tuned.lower, tuned.at_lower), ("upper", tuned.upper, tuned.at_upper))
    for side, bound, often in sides:
        if often is not None and often >= OFTEN:
            at = f"{tuned.name} is at its {side} bound, {bound:g}"
            yield f"{at}, in {share(often)} of {many(tuned.n, 'repetition')}"


def _sensor(found: SensorError) -> str:
    value = f"{number(found.value, 2)}{f' {found.unit}' if found.unit else ''}"
    return f"{found.name}, by {number(found.noises, 2)} × noise or {value}, most at {found.worst_s:g} s"
