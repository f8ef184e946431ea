"""A tuner that moves a distribution of simulators towards those that reproduce the samples, in bounded steps."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import scipy
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.space import Space
from gaplab.services.core.tuners.base import Tuner, TuningTask, equally_probable
from gaplab.services.core.types import Simulator

FEWEST = 10
"""Fewest draws of an update: a bound of 1 nat leaves about a third of them their weight."""

HOTTEST = 1e6
"""Temperature at which all draws weigh the same."""

NARROWEST = 1e-3
"""Least standard deviation, as a share of the bounds."""

CONFIDENCE = 1.96
"""Half the width of a 95 % interval, in standard deviations."""


class SimOptOptions(Frozen):
    """Options of the tuner `simopt`."""

    draws: Annotated[int, Field(strict=True, ge=FEWEST, le=100_000)] = Field(
        default=200, description="simulators of an update, fewer if the evaluations do not suffice; gaplab's default"
    )
    updates: Annotated[int, Field(strict=True, ge=1, le=100)] = Field(
        default=3, description="updates of the distribution after each sample; gaplab's default"
    )
    divergence: Annotated[float, Field(strict=True, gt=0, le=100)] = Field(
        default=1.0, description="most that an update may diverge from the draws before it (Kullback-Leibler), in nats"
    )
    damping: Annotated[float, Field(strict=True, ge=1, le=100)] = Field(
        default=2.0, description="root of the change of a variance that an update makes; the third parties' code: 2"
    )
    least_temperature: Annotated[float, Field(strict=True, gt=0, le=1)] = Field(
        default=0.001, description="least temperature of the weights of draws; the third parties' code: 0.001"
    )
    deviation: Annotated[float, Field(strict=True, gt=0, le=1)] = Field(
        default=0.3,
        description="first standard deviation around the middle, as a share of the bounds; gaplab's default: about "
        "that of a uniform draw",
    )


class SimOpt(Tuner):
    """SimOpt: a Gaussian of simulators, updated by relative entropy policy search (REPS) and kept between tunings.

    An update draws simulators within the bounds, costs each on all samples, and weights them by exp(−cost/temperature).
    The temperature is the least with which the weights diverge from equal ones by no more than the bound. The mean
    becomes the weighted mean. Each variance changes by a root of what the weights make of it. The first simulator is
    the mean, with the interval of the Gaussian, so the next tuning goes on from it. Others are draws, equally probable.

    For the authors' method, combine it with the discrepancy `readings` and its `absolute_weight`, and with the strategy
    `weighted`, whose `transfer` is the mean. Do not use it for intervals with noisy measurements: its Gaussian narrows
    with each update, whatever the noise; `abc_smc` has a posterior. With a budget for few simulators, `gauss_newton` is
    better.
    """

    name = "simopt"
    source = (
        "Chebotar et al. 2019; numbers of REPS as in third parties' code (kl_threshold, covariance_damping, "
        "min_temperature), which damps all variances by their mean; one variance a tunable is gaplab's"
    )
    intervals = True
    Options = SimOptOptions
    options: SimOptOptions

    def least_evaluations(self, optimizer: Optimizer, ensemble: int) -> int:  # noqa: ARG002 - it does not use one
        """Return one for each member of the ensemble, and those of the smallest update."""
        return ensemble + FEWEST

    def tune(self, task: TuningTask, rng: Generator) -> tuple[Simulator, ...]:
        """Return the mean of the updated Gaussian with its interval, then draws from it."""
        left = task.evaluations - task.ensemble
        gaussian = self._before(task)
        updates = min(self.options.updates, left // FEWEST)
        for _ in range(updates):
            drawn = gaussian.draw(min(self.options.draws, left // updates), rng)
            gaussian = self._updated(gaussian, drawn, task.misfit.of(task.space.at(drawn)))
        found = task.space.at(np.vstack([gaussian.mean, gaussian.draw(task.ensemble - 1, rng)]))
        return equally_probable(found, task.misfit.of(found), gaussian.interval(task.space))

    def _before(self, task: TuningTask) -> "Gaussian":
        """Return the Gaussian of the tuning before, which its first simulator holds; at first one around the middle."""
        space, size = task.space, task.space.size
        if task.previous and (interval := task.previous[0].interval) is not None:
            mean = (task.previous[0].parameters - space.lower) / space.extent
            return Gaussian(mean, (interval[:, 1] - interval[:, 0]) / space.extent / (2 * CONFIDENCE))
        return Gaussian(np.full(size, 0.5), np.full(size, self.options.deviation))

    def _updated(self, gaussian: "Gaussian", drawn: FloatArray, costs: FloatArray) -> "Gaussian":
        """Return the Gaussian after an update with the costs `(n,)` of draws `(n, p)`; inf: the physics failed."""
        sound = np.isfinite(costs)
        if sound.sum() < FEWEST:
            return gaussian
        drawn = drawn[sound]
        weights = reps_weights(costs[sound], self.options.divergence, self.options.least_temperature)
        mean = weights @ drawn
        change = (weights @ (drawn - mean) ** 2) / np.maximum(drawn.var(axis=0), NARROWEST**4)
        deviation = gaussian.deviation * change ** (0.5 / self.options.damping)
        return Gaussian(mean, np.maximum(deviation, NARROWEST))


@dataclass(frozen=True, eq=False)
class Gaussian:
    """Independent normal distributions of the tunables, in units of their bounds.

    Attributes:
        mean: `(p,)`, from 0 to 1.
        deviation: `(p,)`: standard deviations, above 0.
    """

    mean: FloatArray
    deviation: FloatArray

    def draw(self, count: int, rng: Generator) -> FloatArray:
        """Return draws `(count, p)` that are within the bounds, from 0 to 1."""
        below, above = (scipy.special.ndtr((end - self.mean) / self.deviation) for end in (0.0, 1.0))
        shares = below + (above - below) * rng.random((count, len(self.mean)))
        return np.asarray(np.clip(self.mean + self.deviation * scipy.special.ndtri(shares), 0.0, 1.0))

    def interval(self, space: Space) -> FloatArray:
        """Return `(p, 2)`: ends of the 95 % intervals around the mean, beyond the bounds too: they tell it all."""
        ends = self.mean[:, None] + CONFIDENCE * self.deviation[:, None] * np.array([-1.0, 1.0])
        return np.asarray(space.lower[:, None] + space.extent[:, None] * ends)


def reps_weights(costs: FloatArray, divergence: float, least_temperature: float) -> FloatArray:
    """Return weights `(n,)` with sum 1 of draws by their finite costs `(n,)`, which count as shares of their range.

    They are proportional to exp(−cost/temperature), with the temperature that minimises the dual of REPS: the least
    with which the weights diverge from equal ones by no more than `divergence`, or `least_temperature`.

    Source: Peters, Mülling and Altun 2010; Deisenroth, Neumann and Peters 2013, section 2.4.3.
    """
    shares = (costs - costs.min()) / max(float(np.ptp(costs)), 1e-300)

    def weighted(logarithm: float) -> FloatArray:
        weights = np.exp(-shares / np.exp(logarithm))
        return np.asarray(weights / weights.sum())

    def excess(logarithm: float) -> float:
        weights = weighted(logarithm)
        return float(scipy.special.xlogy(weights, weights * len(weights)).sum()) - divergence

    coldest, hottest = np.log(least_temperature), np.log(HOTTEST)
    return weighted(coldest if excess(coldest) <= 0 else float(scipy.optimize.brentq(excess, coldest, hottest)))
