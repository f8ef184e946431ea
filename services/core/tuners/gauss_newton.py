"""A tuner for few rollouts: least squares by slopes, with intervals."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import scipy
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.linear_models import LinearModel, cutter
from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.tuners.base import Tuner, TuningTask
from gaplab.services.core.types import Simulator

CONFIDENCE = 0.95
"""Probability that an interval contains the truth."""

REACH = 2.0
"""Half the width of the next box, in standard deviations of the estimate."""

NARROWEST = 1e-3
"""Least width of a box, as a share of the bounds."""


class GaussNewtonOptions(Frozen):
    """Options of the tuner `gauss_newton`."""

    evaluations: Annotated[int, Field(strict=True, ge=8, le=1_000_000)] = Field(
        default=60, description="most simulators to evaluate; the rest of the budget is saved"
    )
    rounds: Annotated[int, Field(strict=True, ge=1, le=20)] = Field(
        default=2, description="linear models, each in a smaller box around the estimate so far"
    )


class GaussNewton(Tuner):
    """Least squares with linear models over boxes of simulators, and a 95 % interval of each tunable.

    Contact is rough: a step of a thousandth of the bounds may change a reading as much as a tenth. So slopes are not
    differences between two simulators, but regressions over a box of them. The scatter around the lines counts as
    noise. The next box surrounds the estimate.

    An interval comes from leave-one-out errors: each simulator of the box is estimated from the others. It is as wide
    as the bounds where the samples say nothing about a tunable. An ensemble is the estimate and draws from its error,
    all equally probable.
    """

    name = "gauss_newton"
    source = "Gauss-Newton with statistical linearisation, as in iterated Kalman filters; all numbers are gaplab's"
    needs_squares = True
    intervals = True
    Options = GaussNewtonOptions
    options: GaussNewtonOptions

    def least_evaluations(self, optimizer: Optimizer, ensemble: int) -> int:  # noqa: ARG002 - it does not use one
        """Return one for each member of the ensemble, and one for the estimate."""
        return ensemble + 1

    def tune(self, task: TuningTask, rng: Generator) -> tuple[Simulator, ...]:
        """Return the estimate with its intervals, then draws from its error."""
        left = min(max(self.options.evaluations - task.ensemble, 1), task.evaluations - task.ensemble)
        box = np.array([np.zeros(task.space.size), np.ones(task.space.size)])
        places, differences = np.empty((0, task.space.size)), None
        estimate = None
        for share in filter(len, np.array_split(np.arange(left), self.options.rounds)):
            hypercube = scipy.stats.qmc.LatinHypercube(task.space.size, seed=rng)
            drawn = box[0] + (box[1] - box[0]) * hypercube.random(len(share))
            found = task.misfit.residuals(task.space.at(drawn))
            places = np.vstack([places, drawn])
            differences = found if differences is None else np.vstack([differences, found])
            inside = ((box[0] <= places) & (places <= box[1])).all(axis=1) & np.isfinite(differences).all(axis=1)
            if inside.sum() > task.space.size + 2:
                estimate = _estimate(places[inside], differences[inside], task.misfit.noise)
                box = estimate.box(box)
        return _simulators(task, estimate or LocalEstimate.unknown(task.space.size), rng)


@dataclass(frozen=True, eq=False)
class LocalEstimate:
    """An estimate of the tunables, in units of their bounds.

    Attributes:
        place: `(p,)`, from 0 to 1.
        errors: `(n, p)`: leave-one-out errors of n simulators.
    """

    place: FloatArray
    errors: FloatArray

    @classmethod
    def unknown(cls, size: int) -> "LocalEstimate":
        """Return the middle of the bounds, with both bounds as its errors."""
        return cls(np.full(size, 0.5), np.array([np.full(size, -0.5), np.full(size, 0.5)]))

    @property
    def covariance(self) -> FloatArray:
        """Return `(p, p)`: the mean products of errors."""
        return np.asarray(self.errors.T @ self.errors / len(self.errors))

    def interval(self) -> FloatArray:
        """Return `(p, 2)`: ends of the interval of each tunable, by Student's t."""
        freedom = max(1, len(self.errors) - self.place.size - 1)
        half = scipy.stats.t.ppf((1 + CONFIDENCE) / 2, freedom) * np.sqrt(np.diag(self.covariance))
        return np.asarray(np.clip(np.transpose([self.place - half, self.place + half]), 0.0, 1.0))

    def box(self, within: FloatArray) -> FloatArray:
        """Return the next box `(2, p)`, a part of this one."""
        half = np.maximum(REACH * np.sqrt(np.diag(self.covariance)), NARROWEST / 2)
        lower = np.clip(self.place - half, within[0], within[1] - NARROWEST)
        return np.array([lower, np.clip(self.place + half, lower + NARROWEST, within[1])])


def _estimate(places: FloatArray, differences: FloatArray, noise: float) -> LocalEstimate:
    """Return an estimate of where all differences are 0, and its errors where the answer is known.

    Args:
        places: `(n, p)`, n simulators in units of the bounds.
        differences: `(n, r)`: of their readings from those of reality.
        noise: variance of a difference of the right simulator.
    """
    cut = cutter(differences, noise)
    answers = cut(differences)
    others = ~np.eye(len(places), dtype=bool)
    known = [
        LinearModel.of(places[rest], answers[rest], noise).place(one) for rest, one in zip(others, answers, strict=True)
    ]
    estimate = LinearModel.of(places, answers, noise).place(cut(np.zeros(answers.shape[1])))
    return LocalEstimate(estimate, np.array(known) - places)


def _simulators(task: TuningTask, estimate: LocalEstimate, rng: Generator) -> tuple[Simulator, ...]:
    """Return the estimate with its intervals, then draws from its error; each with its discrepancy."""
    drawn = rng.multivariate_normal(estimate.place, estimate.covariance, task.ensemble - 1)
    found = task.space.at(np.clip(np.vstack([estimate.place, drawn]), 0.0, 1.0))
    errors, weight = task.misfit.of(found), 1.0 / task.ensemble
    interval = task.space.at(estimate.interval().T).T
    first = Simulator(found[0], float(errors[0]), interval, weight)
    others = zip(found[1:], errors[1:], strict=True)
    return (first, *(Simulator(parameters, float(error), None, weight) for parameters, error in others))
