"""Misfit after tuning: the remaining error, the agreement between repetitions, and tunables at their bounds.

An error that remains in every repetition with a small spread is not bad luck: no setting of the tunables fits. A
tunable that varies over repetitions as much as a random one was not identified. A tunable at its bound may need wider
bounds, or it compensates for an effect that no tunable has.

Source: gaplab.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

import numpy as np

from gaplab.schemas.misfit import Distribution, MisfitPoint, TunableDistribution
from gaplab.services.core.arrays import FloatArray, known
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.discrepancies.fitness import SquaredFitness
from gaplab.services.core.linear_models import CREDIBLE, SURPRISING
from gaplab.services.core.space import Space
from gaplab.services.core.types import Fit
from gaplab.services.findings import wording
from gaplab.services.world.sensing import Sensors

AT_BOUND = 0.01
"""Largest distance from a bound, as a share of the distance between the bounds, that counts as at the bound."""

PRIOR_SD = 12**-0.5
"""Standard deviation of a uniform draw between the bounds, as a share of their distance."""

PRIOR_95 = 0.95
"""Width of the central 95 % of such draws, as a share of the distance between the bounds."""

OFTEN = 0.5
"""Share of repetitions at a bound from which a remark says so."""


class Doubt(Enum):
    """Why agreement may not be truth."""

    WRONG = "no simulator reproduces the samples"
    SOME = "the samples raise some doubt about the model"
    UNTESTED = "nothing tells noise from a wrong model"


class SensorError(NamedTuple):
    """How far the readings of a sensor are off in the best simulators: root mean square over times and repetitions."""

    name: str
    unit: str
    noises: float  # the error in units of the sensor's noise
    value: float  # the error in its unit
    worst_s: float  # the time at which it is largest


@dataclass(frozen=True, eq=False)
class Tuning:
    """The best simulator of one iteration of one repetition.

    Attributes:
        parameters: `(p,)`, values of its tunables.
        squared_error: discrepancy summed over its samples, by default Σe²; inf if the physics failed on one.
        samples: number of samples that it was tuned on.
        simulated: simulated fitness of the controller that evolved in it; nan if there is none yet.
        real: fitness of that controller in reality; nan if there is none yet.
        held_out_error: the same over held-out samples; nan if there are none yet, or the physics failed on one.
        held_out: number of held-out samples.
        interval: `(p, 2)`: ends of the 95 % intervals of its tunables; None if the tuner gives none.
        posterior: `(p,)`: standard deviations of the posterior; None if the tuner gives none.
        discrepancy: what tuning minimised.
        fit: how well it reproduces the samples; None if it is not known.
    """

    parameters: FloatArray
    squared_error: float
    samples: int
    simulated: float
    real: float
    held_out_error: float = float("nan")
    held_out: int = 0
    interval: FloatArray | None = None
    posterior: FloatArray | None = None
    discrepancy: Discrepancy = field(default_factory=SquaredFitness)
    fit: Fit | None = None

    @property
    def expected(self) -> float:
        """Error per sample that noise and rough physics alone would leave; nan if it is not known."""
        return float("nan") if self.fit is None else self._error(self.fit.expected_error, self.samples)

    @property
    def error(self) -> float:
        """Error per sample, by default √(Σe² / samples); nan without samples, or if the physics failed."""
        return self._error(self.squared_error, self.samples)

    @property
    def error_on_held_out(self) -> float:
        """Error per held-out sample; nan without any, or if the physics failed."""
        return self._error(self.held_out_error, self.held_out)

    def _error(self, total: float, count: int) -> float:
        return self.discrepancy.error(total / count) if count and np.isfinite(total) else float("nan")


def misfit_point(iteration: int, tunings: Sequence[Tuning], names: Sequence[str], space: Space) -> MisfitPoint:
    """Return the misfit of an iteration, over the tunings of the repetitions that have reached it, maybe none.

    Names and bounds are those of the p tunables.
    """
    parameters = np.array([each.parameters for each in tunings]).reshape(-1, space.size)
    widths = [each.interval[:, 1] - each.interval[:, 0] for each in tunings if each.interval is not None]
    deviations = [each.posterior for each in tunings if each.posterior is not None]
    shares = _shares(widths, PRIOR_95 * space.extent), _shares(deviations, PRIOR_SD * space.extent)
    return MisfitPoint(
        iteration=iteration,
        error=_distribution([each.error for each in tunings]),
        expected_error=_distribution([each.expected for each in tunings]),
        held_out_error=_distribution([each.error_on_held_out for each in tunings]),
        gap=_distribution([abs(each.simulated - each.real) for each in tunings]),
        tunables=tuple(
            map(_tunable_distribution, names, parameters.T, space.lower.tolist(), space.upper.tolist(), *shares)
        ),
    )


def surprise(tunings: Sequence[Tuning]) -> float | None:
    """Return the surprise that at least half of the repetitions that have one reach; None if none has."""
    known_ = sorted(each.fit.surprise for each in tunings if each.fit is not None)
    return known_[(len(known_) - 1) // 2] if known_ else None


def doubt(tunings: Sequence[Tuning], *, simulated: bool) -> Doubt | None:
    """Return the doubt about the model; None without any, and for a simulated reality that has no noise."""
    found = surprise(tunings)
    if found is None:
        return None if simulated else Doubt.UNTESTED
    if found <= SURPRISING:
        return Doubt.WRONG
    return Doubt.SOME if found <= CREDIBLE else None


def sensor_errors(fits: Sequence[Fit], sensors: Sensors | None) -> list[SensorError]:
    """Return how far the readings of each sensor are off, the largest in units of noise first; empty if unknown."""
    rows = [fit.reading_errors for fit in fits if fit.reading_errors.size]
    if sensors is None or not rows or rows[0].size != sensors.size:
        return []
    squares = np.square(rows).reshape(len(rows), len(sensors.times_s), len(sensors.names))
    by_time = np.sqrt(_mean(squares, 0))
    by_sensor = np.sqrt(_mean(by_time**2, 0))
    places = np.argsort(-np.nan_to_num(by_sensor, nan=-1.0), kind="stable").tolist()
    worst = np.argmax(np.nan_to_num(by_time, nan=-1.0), axis=0)
    return [
        SensorError(
            sensors.names[place],
            sensors.units[place],
            float(by_sensor[place]),
            float(by_sensor[place] * sensors.noises[place]),
            float(sensors.times_s[worst[place]]),
        )
        for place in places
    ]


def _mean(values: FloatArray, axis: int) -> FloatArray:
    """Return the mean over an axis without nan; 0 where nothing is known."""
    there = np.isfinite(values)
    return np.asarray(np.where(there, values, 0.0).sum(axis) / np.maximum(there.sum(axis), 1))


def _tunable_distribution(
    name: str, values: FloatArray, lower: float, upper: float, interval: float | None, posterior: float | None
) -> TunableDistribution:
    near, found = AT_BOUND * (upper - lower), _distribution(values)
    at_lower = float((values <= lower + near).mean()) if len(values) else None
    at_upper = float((values >= upper - near).mean()) if len(values) else None
    return TunableDistribution(
        **found.model_dump(),
        name=name,
        lower=lower,
        upper=upper,
        at_lower=at_lower,
        at_upper=at_upper,
        at_bounds=", ".join(
            f"{wording.share(there)} at {wording.number(bound)}"
            for bound, there in ((lower, at_lower), (upper, at_upper))
            if there
        ),
        spread=None if found.sd is None else found.sd / (PRIOR_SD * (upper - lower)),
        interval=interval,
        posterior=posterior,
    )


def _shares(found: Sequence[FloatArray], prior: FloatArray) -> list[float | None]:
    """Return the mean of each tunable's number over that of the prior; None without any."""
    return [None] * len(prior) if not found else [known(each) for each in np.mean(found, axis=0) / prior]


def _distribution(values: Sequence[float] | FloatArray) -> Distribution:
    there = np.asarray(values, dtype=np.float64)
    there = there[np.isfinite(there)]
    with np.errstate(over="ignore", invalid="ignore"):
        mean = known(there.mean()) if len(there) else None
        sd = known((there - there.min()).std(ddof=1)) if len(there) > 1 else None  # exactly 0 if all are equal
    return Distribution(
        n=len(there),
        mean=mean,
        sd=sd,
        least=float(there.min()) if len(there) else None,
        greatest=float(there.max()) if len(there) else None,
        text=wording.spread(mean, sd),
    )
