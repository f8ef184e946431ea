"""A tuner for few rollouts: least squares by the slopes of all differences."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.random import Generator
from pydantic import Field
from scipy.optimize import least_squares

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.tuners.base import Task, Tuner
from gaplab.services.core.types import Simulator

NORMAL_95 = 1.96
"""Standard deviations on each side of the mean that hold 95 % of a normal distribution."""

FLATTEST = 1e-9
"""Smallest curvature, as a share of the largest, along which the differences say anything."""


class GaussNewtonOptions(Frozen):
    """Options of least squares."""

    starts: Annotated[int, Field(strict=True, ge=1, le=100)] = Field(
        default=3, description="descents: from the best simulator so far, and from random ones"
    )
    difference: Annotated[float, Field(strict=True, gt=0, lt=0.5)] = Field(
        default=0.02,
        description="step of the slopes as a share of the bounds; contact is too rough for smaller ones",
    )
    evaluations: Annotated[int, Field(strict=True, ge=2, le=1_000_000)] = Field(
        default=60, description="most simulators to evaluate; the rest of the budget is saved"
    )


@dataclass(frozen=True, eq=False)
class Fit:
    """The end of a descent.

    Attributes:
        place: `(p,)`, in units of the bounds, from 0 to 1.
        residuals: `(r,)`, differences there.
        slopes: `(r, p)`, of the differences there.
    """

    place: FloatArray
    residuals: FloatArray
    slopes: FloatArray

    @property
    def cost(self) -> float:
        """The sum of squares."""
        return float(self.residuals @ self.residuals)

    def covariance(self, noise: float) -> FloatArray:
        """Return `(p, p)`: the covariance of the place, in units of the bounds.

        Along a direction on which no difference depends, the deviation is the whole of the bounds.

        Args:
            noise: variance of a difference if the simulator is right; a larger remaining error counts instead.
        """
        rows, columns = self.slopes.shape
        if rows <= columns:
            return np.eye(columns)
        curvatures, directions = np.linalg.eigh(self.slopes.T @ self.slopes)
        told = curvatures > FLATTEST * max(float(curvatures[-1]), np.finfo(float).tiny)
        noise = max(noise, self.cost / (rows - columns))
        variances = np.ones(columns)
        variances[told] = np.minimum(1.0, noise / curvatures[told])
        return np.asarray((directions * variances) @ directions.T)


class GaussNewton(Tuner):
    """Least squares from several starts, with a 95 % confidence interval of each tunable.

    Slopes are differences over a share of the bounds. The interval is of a linear model around the best simulator. It
    is as wide as the bounds if there are no more differences than tunables, or where no difference depends on the
    tunable. An ensemble consists of the best simulator and of draws from its confidence region.
    """

    name = "gauss_newton"
    source = "As in MuJoCo's sysid toolbox (2026); starts, differences and intervals are gaplab's"
    needs_squares = True
    intervals = True
    Options = GaussNewtonOptions
    options: GaussNewtonOptions

    def tune(self, task: Task, rng: Generator) -> tuple[Simulator, ...]:
        """Return the best simulator of all descents with its interval, then draws from its confidence region."""
        left = min(self.options.evaluations, task.evaluations) - (task.ensemble - 1)
        starts = self._starts(task, rng)
        share = max(1, left // (len(starts) * (task.space.size + 1)))
        fits = [fit for start in starts if (fit := self._descent(task, start, share)) is not None]
        if not fits:
            return tuple(Simulator(each, np.inf) for each in task.space.draw(task.ensemble, rng))
        best = min(fits, key=lambda fit: fit.cost)
        covariance = best.covariance(task.misfit.noise)
        deviation = NORMAL_95 * np.sqrt(np.diag(covariance))
        ends = np.clip([best.place - deviation, best.place + deviation], 0.0, 1.0)
        interval = (task.space.lower + ends * task.space.extent).T
        return (
            Simulator(_parameters(task, best.place), best.cost, interval),
            *_drawn(task, best.place, covariance, rng),
        )

    def _starts(self, task: Task, rng: Generator) -> FloatArray:
        """Return the places where descents begin, in units of the bounds."""
        drawn = rng.random((self.options.starts - 1, task.space.size))
        return np.vstack([(task.previous[0].parameters - task.space.lower) / task.space.extent, drawn])

    def _descent(self, task: Task, start: FloatArray, steps: int) -> Fit | None:
        """Return the end of a descent of so many steps; None if the physics fails at its start."""
        answered: dict[bytes, FloatArray] = {}

        def residuals(place: FloatArray) -> FloatArray:
            key = place.tobytes()
            if key not in answered:
                answered[key] = task.misfit.residuals(_parameters(task, place[None, :]))[0]
            return answered[key]

        def slopes(place: FloatArray) -> FloatArray:
            away = np.where(place + self.options.difference <= 1.0, self.options.difference, -self.options.difference)
            beside = task.misfit.residuals(_parameters(task, place + np.diag(away)))
            return np.nan_to_num(((beside - residuals(place)) / away[:, None]).T)

        if not np.isfinite(residuals(start)).all():
            return None
        found = least_squares(residuals, start, slopes, bounds=(0.0, 1.0), max_nfev=steps)
        return Fit(found.x, found.fun, found.jac)


def _parameters(task: Task, places: FloatArray) -> FloatArray:
    return task.space.lower + places * task.space.extent


def _drawn(task: Task, place: FloatArray, covariance: FloatArray, rng: Generator) -> list[Simulator]:
    """Return the other simulators of an ensemble, best first."""
    if task.ensemble == 1:
        return []
    drawn = _parameters(task, np.clip(rng.multivariate_normal(place, covariance, task.ensemble - 1), 0.0, 1.0))
    costs = task.misfit.of(drawn)
    return [Simulator(drawn[index], float(costs[index])) for index in np.argsort(costs, kind="stable")]
