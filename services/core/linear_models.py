"""Linear models of many answers of simulators: the place that given answers come from, and what none reproduces.

Whether any simulator reproduces the samples is told by the error that tuning left, beside what noise and rough physics
leave. Around the best simulator, models of all differences are fitted to neighbours, as `gauss_newton` does. Then some
of its plausible neighbours stand in for reality, with the noise of the measurements, and the models estimate each from
its answers. What remains of reality's answers is compared with what remains of theirs: a posterior predictive check.
Differences are divided by their scatter around the models, so a robot that falls in some simulators and not in others
says little, and a tilt that no simulator has says much.

Intervals are widened by the root of the ratio of the mean squares, if it is above 1, and a little in any case. This
scaled covariance (Birge's ratio) needs no model of what is missing. A sandwich would need more samples than a robot
gives. What noise alone scatters is added, for it moves the estimate, and not the neighbours from which a tuner learns
how far it errs: where answers are smooth, as those of an arm, it is most of the error. `gaplab recover` measures what
intervals cover.

Source: gaplab; Gelman, Meng and Stern 1996 for the check, Birge 1932 for the ratio.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.space import Space
from gaplab.services.core.tuning import Misfit
from gaplab.services.core.types import Fit, Simulator

PRIOR_VARIANCE = 0.25
"""Variance of a tunable before any sample, in units of its bounds. It is three times that of a uniform one, so that a
truth on a bound is hardly drawn to the middle."""

OWN = 0.3
"""Share of the scatter of an answer that is taken as its own, independent of the others."""

FARTHEST = 3.0
"""Deviations from the median at which an answer is cut; a robot that falls is not a line."""


def cutter(answers: FloatArray, noise: float) -> Callable[[FloatArray], FloatArray]:
    """Return a function that clips answers `(…, r)` to `FARTHEST` deviations around the medians of these `(n, r)`."""
    import scipy  # a process that never tunes starts without it

    middle = np.median(answers, axis=0)
    deviation = scipy.stats.median_abs_deviation(answers, axis=0, scale="normal")
    reach = FARTHEST * np.maximum(deviation, noise**0.5)
    return lambda others: np.clip(others, middle - reach, middle + reach)


@dataclass(frozen=True, eq=False)
class LinearModel:
    """A linear model of r answers over p tunables, in units of their bounds.

    Attributes:
        centre: `(p,)`: mean of the places that it was fitted to.
        level: `(r,)`: answers there.
        slopes: `(r, p)`.
        scatter: `(r,)`: variance of an answer around the model, with the noise.
        weighted: `(r, p)`: the slopes, weighted by the inverse of the answers' covariance.
    """

    centre: FloatArray
    level: FloatArray
    slopes: FloatArray
    scatter: FloatArray
    weighted: FloatArray

    @classmethod
    def of(cls, places: FloatArray, answers: FloatArray, noise: float) -> "LinearModel":
        """Return the model of n answers `(n, r)` at places `(n, p)`.

        Their covariance is low-rank plus diagonal, so that it can be inverted although there are more answers than
        places.

        Args:
            places: from 0 to 1.
            answers: cut, so that one that is far off moves no line.
            noise: variance of an answer of the right simulator.
        """
        (count, size), centre = places.shape, places.mean(axis=0)
        design = np.column_stack([np.ones(count), places - centre])
        lines, *_ = np.linalg.lstsq(design, answers, rcond=None)
        level, slopes = lines[0], lines[1:].T
        scatter = (answers - design @ lines) / np.sqrt(max(1, count - size - 1))
        squares = (scatter**2).sum(axis=0)
        own = OWN * squares + noise
        own = np.maximum(own, 1e-12 * max(float(own.max()), 1e-300))
        shared = np.sqrt(1 - OWN) * scatter
        weighted = slopes / own[:, None]
        inner = np.eye(count) + shared / own @ shared.T
        weighted -= shared.T / own[:, None] @ np.linalg.solve(inner, shared @ weighted)
        return cls(centre, level, slopes, squares + noise, weighted)

    def place(self, asked: FloatArray) -> FloatArray:
        """Return the place `(p,)` whose answers are those asked for, `(r,)`: the mean of a normal posterior."""
        size = len(self.centre)
        middle = np.full(size, 0.5)
        away = asked - self.level - self.slopes @ (middle - self.centre)
        known = self.slopes.T @ self.weighted + np.eye(size) / PRIOR_VARIANCE
        found = middle + np.linalg.solve(known, self.weighted.T @ away)
        return np.asarray(np.clip(found, 0.0, 1.0))

    def scattered(self, noise: float) -> FloatArray:
        """Return `(p,)`: standard deviations of `place` by noise of this variance in each answer."""
        known = self.slopes.T @ self.weighted + np.eye(len(self.centre)) / PRIOR_VARIANCE
        gains = np.linalg.solve(known, self.weighted.T)
        return np.asarray(np.sqrt(noise * (gains * gains).sum(axis=1)))

    def at(self, place: FloatArray) -> FloatArray:
        """Return the answers `(r,)` at a place `(p,)`."""
        return np.asarray(self.level + self.slopes @ (place - self.centre))


NEIGHBOURS = 32
"""Neighbours that the models are fitted to; four times the number of coefficients, if that is more."""

REALITIES = 40
"""Neighbours that play reality."""

LEAST_HALF = 0.1
"""Least half width of the neighbourhood, as a share of the bounds."""

LEAST_SCALE = 1.5
"""Least factor of the half widths of intervals. A tuner that narrows its box in rounds may lose the truth in one of
them, and few samples do not always show that a model is wrong. `CREDIBLE` and this were set on 40 realities, numbers
300 to 339: a quarter less, and 29 in 35 narrow intervals of a robot with longer legs were right, now 31 in 35."""

DEVIATIONS = 2.05
"""Half width of a 95 % interval, in standard deviations by slopes from about 30 neighbours: Student's t."""

NEAR = 0.25
"""Distance of an end of an interval from a bound, as a share of its half width, up to which it ends at the bound."""

SURPRISING = 0.05
"""Share of the played realities that leave as much, at or below which no simulator is said to reproduce the samples."""

CREDIBLE = 0.2
"""The same share, above which tunables may be called identified: then 14 in 15 of those intervals were right."""


def fitted(simulators: tuple[Simulator, ...], misfit: Misfit, space: Space, rng: Generator) -> tuple[Simulator, ...]:
    """Return the simulators, of which the best has how well it reproduces the samples; see `fit_of`."""
    best, *others = simulators
    return (replace(best, fit=fit_of(best, misfit, space, rng)), *others)


def fit_of(best: Simulator, misfit: Misfit, space: Space, rng: Generator) -> Fit | None:
    """Return how well the best simulator reproduces the samples that it was tuned on, whose misfit this is.

    None if the noise is unknown, or the physics fails around it.
    """
    noise = misfit.noise
    if not noise:
        return None
    import scipy  # a process that never tunes starts without it

    centre = (best.parameters - space.lower) / space.extent
    half = np.full(space.size, LEAST_HALF)
    if best.interval is not None:
        half = np.maximum(half, (best.interval[:, 1] - best.interval[:, 0]) / space.extent / 2)
    lower, upper = np.clip(centre - half, 0.0, 1.0), np.clip(centre + half, 0.0, 1.0)
    cube = scipy.stats.qmc.LatinHypercube(space.size, seed=rng)
    places = lower + (upper - lower) * cube.random(max(NEIGHBOURS, 4 * (space.size + 1)))
    played = np.clip(centre + half / 2 * rng.normal(size=(REALITIES, space.size)), 0.0, 1.0)
    answers, asked = (_sound(misfit.residuals(space.at(each))) for each in (places, played))
    if len(answers[1]) < 2 * (space.size + 1) or not len(asked[1]):
        return None
    cut, compared = cutter(answers[1], noise), (answers[1] != 0.0).any(axis=0)
    model = LinearModel.of(places[answers[0]], cut(answers[1]), noise)
    noisy = asked[1] + np.where(compared, rng.normal(size=asked[1].shape) * noise**0.5, 0.0)
    left = np.array([_left(model, each, model.place(cut(each)), compared) for each in noisy])
    real = np.zeros(len(compared))
    own = _left(model, real, model.place(cut(real)), compared)
    return Fit(
        expected_error=float(np.median(left[:, 0])),
        surprise=float((1 + (left[:, 2] >= own[2]).sum()) / (1 + len(left))),
        interval_scale=float(LEAST_SCALE * max(1.0, own[1] / np.median(left[:, 1])) ** 0.5),
        reading_errors=misfit.reading_errors(best.parameters),
        noise=frozen(model.scattered(noise) * space.extent),
    )


def widened(interval: FloatArray, parameters: FloatArray, fit: Fit | None, space: Space) -> FloatArray:
    """Return an interval `(p, 2)` around a simulator `(p,)`, each half widened by its fit, within the bounds.

    What noise alone scatters is added as a square. Without a fit, each half stays. An end that is near a bound, by
    `NEAR` of its half, is the bound: estimates of a truth on a bound are drawn inwards.
    """
    half = np.abs(interval - parameters[:, None])
    if fit is not None:
        by_noise = DEVIATIONS * fit.noise[:, None] if fit.noise.size else 0.0
        half = np.hypot(fit.interval_scale * half, by_noise)
    near = (1.0 + NEAR) * half
    lower = np.where(parameters - near[:, 0] <= space.lower, space.lower, parameters - half[:, 0])
    upper = np.where(parameters + near[:, 1] >= space.upper, space.upper, parameters + half[:, 1])
    return frozen(np.stack([lower, upper], axis=-1))


def _sound(answers: FloatArray) -> tuple[NDArray[np.bool_], FloatArray]:
    """Return which rows are finite, and these."""
    finite = np.asarray(np.isfinite(answers).all(axis=1))
    return finite, answers[finite]


def _left(
    model: LinearModel, asked: FloatArray, place: FloatArray, compared: NDArray[np.bool_]
) -> tuple[float, float, float]:
    """Return the residuals of a model to answers `(r,)` at a place, as three numbers.

    It is the sum of squares; the mean of the squares over their scatter; and the mean of log(1 + these).
    """
    away = asked - model.at(place)
    ratios = away[compared] ** 2 / model.scatter[compared]
    return float(away @ away), float(ratios.mean()), float(np.log1p(ratios).mean())
