"""Tuners by least squares, with intervals: by slopes over boxes for rough answers, and at a point for smooth ones."""

from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import scipy
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.linear_models import PRIOR_VARIANCE, LinearModel, cutter
from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.tuners.base import Tuner, TuningTask, equally_probable
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
        default=60,
        description="most simulators to evaluate; the rest of the budget is saved; they say nothing unless each round "
        "has three more than there are tunables, beside the ensemble",
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


class LeastSquaresOptions(Frozen):
    """Options of the tuner `least_squares`."""

    step: Annotated[float, Field(strict=True, gt=0, le=0.5)] = Field(
        default=0.1, description="difference between two simulators that give a slope, as a share of the bounds"
    )
    loss: Literal["linear", "soft_l1", "huber", "cauchy"] = Field(
        default="linear", description="what a large difference counts: its square (linear), or less"
    )
    beyond: Annotated[float, Field(strict=True, gt=0, le=1e6)] = Field(
        default=3.0, description="difference, over its noise, from which it counts less, if the loss is not linear"
    )


class LeastSquares(Tuner):
    """Least squares from one place, with slopes by differences: for many tunables, and answers without much contact.

    It starts from the tuning before, or in the middle of the bounds, and goes on until nothing gains or the budget has
    no slopes left. The first slopes cost one simulator for each tunable. Then tunables that move different answers,
    like those of two joints, share one, and a slope counts if it is at least the root mean square of its tunable's.
    Estimate and intervals are those of the last slopes. In rough contact, `gauss_newton` is better.
    """

    name = "least_squares"
    source = "Trust region reflective of scipy: Branch, Coleman and Li 1999; steps are gaplab's"
    needs_squares = True
    intervals = True
    Options = LeastSquaresOptions
    options: LeastSquaresOptions

    def least_evaluations(self, optimizer: Optimizer, ensemble: int) -> int:  # noqa: ARG002 - it does not use one
        """Return one for each member of the ensemble, and one for the estimate."""
        return ensemble + 1

    def tune(self, task: TuningTask, rng: Generator) -> tuple[Simulator, ...]:
        """Return the estimate with its intervals, then draws from its error."""
        size, before = task.space.size, task.previous[:1]
        if task.evaluations < task.ensemble + 2 * (size + 1):
            return _simulators(task, LocalEstimate.unknown(size), rng)
        start = np.full(size, 0.5)
        if before and before[0].interval is not None:
            start = (before[0].parameters - task.space.lower) / task.space.extent
        answers = _Smooth(task, self.options.step)
        with suppress(_Spent):
            scipy.optimize.least_squares(
                answers,
                np.clip(start, NARROWEST, 1.0 - NARROWEST),
                answers.slopes,
                (0.0, 1.0),
                x_scale="jac",
                loss=self.options.loss,
                f_scale=self.options.beyond * max(task.misfit.noise, 1e-12) ** 0.5,
            )
        place, level, jacobian = answers.best
        freedom = max(1, len(level) - size)
        variance = max(float(level @ level) / freedom, task.misfit.noise, LEAST_VARIANCE)
        covariance = np.linalg.inv(jacobian.T @ jacobian / variance + np.eye(size) / PRIOR_VARIANCE)
        return _simulators(task, LocalEstimate(place, frozen(covariance), freedom), rng)


class _Spent(Exception):
    """The evaluations are spent."""


class _Smooth:
    """Answers at a place and their slopes, within the evaluations of a task.

    After the first slopes, tunables that move different answers share a simulator, as in Curtis, Powell and Reid 1974.
    """

    def __init__(self, task: TuningTask, step: float) -> None:
        self._task, self._step, self._left = task, step, task.evaluations - task.ensemble
        self._known = dict[bytes, FloatArray]()
        self._moved: NDArray[np.bool_] | None = None
        self._groups = [[column] for column in range(task.space.size)]
        self.best = (np.empty(0), np.empty(0), np.empty((0, 0)))

    def __call__(self, place: FloatArray) -> FloatArray:
        """Return the differences `(r,)` of a simulator `(p,)` in units of the bounds."""
        if (key := place.tobytes()) not in self._known:
            self._known[key] = self._answers(place[None])[0]
        return self._known[key]

    def slopes(self, place: FloatArray) -> FloatArray:
        """Return the slopes `(r, p)` there."""
        level, steps = self(place), np.where(place + self._step <= 1.0, self._step, -self._step)
        moves = np.zeros((len(self._groups), len(place)))
        for row, group in zip(moves, self._groups, strict=True):
            row[group] = steps[group]
        changes = self._answers(place + moves) - level
        found = np.zeros((len(level), len(place)))
        for change, group in zip(changes, self._groups, strict=True):
            for column in group:
                own = slice(None) if self._moved is None else self._moved[:, column]
                found[own, column] = change[own] / steps[column]
        if self._moved is None:
            self._moved = (found != 0.0) & (np.abs(found) > OVERLAP * np.sqrt((found**2).mean(axis=0)))
            self._groups = _apart(self._moved)
        self.best = place.copy(), level, found
        return found

    def _answers(self, places: FloatArray) -> FloatArray:
        if len(places) > self._left:
            raise _Spent
        self._left -= len(places)
        found = self._task.misfit.residuals(self._task.space.at(places))
        return np.where(np.isfinite(found), found, FAILED)


def _apart(moved: NDArray[np.bool_]) -> list[list[int]]:
    """Return groups of columns, of which no two are true in one row."""
    groups = list[list[int]]()
    for column in range(moved.shape[1]):
        free = (each for each in groups if not (moved[:, each].any(axis=1) & moved[:, column]).any())
        if (group := next(free, None)) is None:
            groups.append([column])
        else:
            group.append(column)
    return groups


OVERLAP = 1.0 - 1e-9
"""Slope of an answer, over the root mean square of a tunable's slopes, above which the tunable moves it; 1, rounded."""

LEAST_VARIANCE = 1e-30
"""Of a difference, where a simulator reproduces the samples to the last bit."""

FAILED = 1e6
"""Difference of an answer where the physics failed."""


@dataclass(frozen=True, eq=False)
class LocalEstimate:
    """An estimate of the tunables, in units of their bounds.

    Attributes:
        place: `(p,)`, from 0 to 1.
        covariance: `(p, p)`, of its error.
        freedom: degrees of freedom of that.
    """

    place: FloatArray
    covariance: FloatArray
    freedom: int

    @classmethod
    def unknown(cls, size: int) -> "LocalEstimate":
        """Return the middle of the bounds, with half their width as the deviation of each tunable."""
        return cls(np.full(size, 0.5), 0.25 * np.eye(size), 1)

    def interval(self) -> FloatArray:
        """Return `(p, 2)`: ends of the interval of each tunable, by Student's t."""
        half = scipy.stats.t.ppf((1 + CONFIDENCE) / 2, self.freedom) * np.sqrt(np.diag(self.covariance))
        return np.asarray(np.clip(np.transpose([self.place - half, self.place + half]), 0.0, 1.0))

    def box(self, within: FloatArray) -> FloatArray:
        """Return the next box `(2, p)`, a part of this one."""
        half = np.maximum(REACH * np.sqrt(np.diag(self.covariance)), NARROWEST / 2)
        lower = np.clip(self.place - half, within[0], within[1] - NARROWEST)
        return np.array([lower, np.clip(self.place + half, lower + NARROWEST, within[1])])


def _estimate(places: FloatArray, differences: FloatArray, noise: float) -> LocalEstimate:
    """Return an estimate of where all differences are 0, and its leave-one-out errors where the answer is known.

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
    errors = np.array(known) - places
    return LocalEstimate(estimate, errors.T @ errors / len(errors), max(1, len(errors) - len(estimate) - 1))


def _simulators(task: TuningTask, estimate: LocalEstimate, rng: Generator) -> tuple[Simulator, ...]:
    """Return the estimate with its intervals, then draws from its error; each with its discrepancy."""
    drawn = rng.multivariate_normal(estimate.place, estimate.covariance, task.ensemble - 1)
    found = task.space.at(np.clip(np.vstack([estimate.place, drawn]), 0.0, 1.0))
    return equally_probable(found, task.misfit.of(found), task.space.at(estimate.interval().T).T)
