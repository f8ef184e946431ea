"""The sentence about samples that no simulator reproduces: how far off, where most, and what is often missing.

Source: gaplab.
"""

from collections.abc import Sequence

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.identification import Doubt
from gaplab.services.core.misfit import Tuning
from gaplab.services.core.misspecification import CREDIBLE, SURPRISING
from gaplab.services.core.sensors import Sensors
from gaplab.services.core.types import Fit

MISSING = (
    "Often missing in a model: a slope of the ground, a weak or slow motor, mass, latency; or a tunable is at its bound"
)

SHOWN = 2
"""Sensors that are named, those with the largest differences."""


def surprise(tunings: Sequence[Tuning]) -> float | None:
    """Return the surprise that at least half of the repetitions that know theirs reach; None if none knows."""
    known = sorted(each.fit.surprise for each in tunings if each.fit is not None)
    return known[(len(known) - 1) // 2] if known else None


def doubt(tunings: Sequence[Tuning], *, simulated: bool) -> Doubt | None:
    """Return the doubt about the model; None without any, and for a simulated reality that has no noise."""
    found = surprise(tunings)
    if found is None:
        return None if simulated else Doubt.UNTESTED
    if found <= SURPRISING:
        return Doubt.WRONG
    return Doubt.SOME if found <= CREDIBLE else None


def unreproduced(tunings: Sequence[Tuning], sensors: Sensors | None, unit: str) -> str:
    """Return that no simulator reproduces the samples, with numbers; "" if one does, or nobody knows.

    Args:
        tunings: the latest tuning of each repetition.
        sensors: of the robot; None if they are not known.
        unit: of errors.
    """
    found = surprise(tunings)
    if found is None or found > SURPRISING:
        return ""
    fits = [each.fit for each in tunings if each.fit is not None]
    said = sum(fit.surprise <= SURPRISING for fit in fits)
    errors = [each.error for each in tunings if each.fit is not None]
    left = [each.expected for each in tunings if each.fit is not None]
    of = f"{said} of {len(fits)} repetitions say so" if len(fits) > 1 else "by one repetition"
    return (
        f"no simulator reproduces the samples: the best err by {np.nanmean(errors):.2g} {unit} a sample, where noise "
        f"and rough physics would leave {np.nanmean(left):.2g} ({of}){_where(fits, sensors)}. {MISSING}"
    )


def _where(fits: Sequence[Fit], sensors: Sensors | None) -> str:
    """Return the sensors with the largest differences, each with its worst time."""
    rows = [fit.reading_errors for fit in fits if fit.reading_errors.size]
    if sensors is None or not rows or rows[0].size != sensors.size:
        return ""
    squares = np.square(rows).reshape(len(rows), len(sensors.times_s), len(sensors.names))
    by_time = np.sqrt(_mean(squares, 0))
    by_sensor = np.sqrt(_mean(by_time**2, 0))
    worst = np.argsort(-np.nan_to_num(by_sensor, nan=-1.0), kind="stable")[:SHOWN]
    told = [_sensor(sensors, place, by_sensor[place], by_time[:, place]) for place in worst.tolist()]
    return f"; most differs {', then '.join(told)}"


def _sensor(sensors: Sensors, place: int, size: float, by_time: FloatArray) -> str:
    name, unit = sensors.names[place], sensors.units[place]
    at = sensors.times_s[int(np.argmax(np.nan_to_num(by_time, nan=-1.0)))]
    value = f"{size * sensors.noises[place]:.2g}{f' {unit}' if unit else ''}"
    return f"{name}, by {size:.2g} × noise or {value}, most at {at:g} s"


def _mean(values: FloatArray, axis: int) -> FloatArray:
    """Return the mean over an axis without nan; nan where nothing is known."""
    known = np.isfinite(values)
    return np.asarray(np.where(known, values, 0.0).sum(axis) / np.maximum(known.sum(axis), 1))
