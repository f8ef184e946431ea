"""A tuner that returns a posterior: simulators as probable as the samples make them."""

from contextlib import suppress
from typing import Annotated, Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Parameters
from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.space import Space
from gaplab.services.core.tuners.base import Tuner, TuningTask, equally_probable
from gaplab.services.core.types import Simulator

WIDER = 2.0
"""Factor of the covariance of particles by which each is moved. Source: Beaumont, Cornuet, Marin and Robert 2009."""

LEAST_WIDTHS = (1e-9, 1e-7, 1e-5, 1e-3)
"""Least standard deviations of a move, as shares of the bounds: the first with which the covariance has a factor."""

LEAST_SIZE = 2
"""Fewest simulators of a round: a single one has no covariance."""

TRIES = 100
"""Draws of a move that leaves the bounds, before the particle stays where it is."""


class AbcSmcOptions(Frozen):
    """Options of the tuner `abc_smc`."""

    rounds: Annotated[int, Field(strict=True, ge=1, le=100)] = Field(
        default=4, description="most rounds, each narrower; one for every two evaluations at most"
    )
    kept: Annotated[float, Field(strict=True, gt=0, lt=1)] = Field(
        default=0.2, description="share of a round's simulators that stay: those with the least discrepancy"
    )
    moves: Literal["redraw", "retry"] = Field(
        default="redraw",
        description="after a move that leaves the bounds, redraw: another particle is drawn, as the weights suppose; "
        "retry: the same one moves again, which draws too many near the bounds",
    )


class AbcSmc(Tuner):
    """Sequential Monte Carlo without a likelihood: draw simulators, keep the best fifth, move them, and weight them.

    The evaluations are divided between the rounds. The ensemble is drawn from the weighted particles of the last round,
    so its members are equally probable; the best particle is the first. The intervals hold 95 % of the particles.
    """

    name = "abc_smc"
    source = "Toni et al. 2009, Beaumont et al. 2009; numbers of rounds and particles are gaplab's"
    intervals = True
    Options = AbcSmcOptions
    options: AbcSmcOptions

    def least_evaluations(self, optimizer: Optimizer, ensemble: int) -> int:  # noqa: ARG002 - it does not use one
        """Return as many particles as the ensemble has members, and at least two."""
        return max(LEAST_SIZE, ensemble)

    def tune(self, task: TuningTask, rng: Generator) -> tuple[Simulator, ...]:
        """Return the best particle, then draws from the posterior."""
        rounds = min(self.options.rounds, max(1, task.evaluations // LEAST_SIZE))
        size = task.evaluations // rounds
        stay = max(2, round(size * self.options.kept))
        particles = task.space.draw(size, rng)
        weights = np.full(size, 1.0 / size)
        redraw = self.options.moves == "redraw"
        for number in range(rounds):
            if number:
                particles, weights = _moved(particles, weights, task.space, size, rng, redraw=redraw)
            errors = task.misfit.of(particles)
            order = np.argsort(errors, kind="stable")[:stay]
            particles, weights, errors = particles[order], weights[order] / weights[order].sum(), errors[order]
        chosen = rng.choice(len(particles), task.ensemble - 1, p=weights)
        ranked = [0, *sorted(chosen.tolist())]
        return equally_probable(particles[ranked], errors[ranked], _interval(particles, weights))


def _moved(
    particles: Parameters, weights: FloatArray, space: Space, count: int, rng: Generator, *, redraw: bool
) -> tuple[Parameters, FloatArray]:
    """Return new particles `(count, p)` near weighted ones, and the prior density over the density of each move."""
    covariance = WIDER * np.cov(particles.T, aweights=weights).reshape(space.size, space.size)
    factor = _factor(covariance, space.extent)
    origin = particles[rng.choice(len(particles), count, p=weights)]
    outside, found = np.arange(count), origin.copy()
    for _ in range(TRIES):
        found[outside] = origin[outside] + rng.standard_normal((len(outside), space.size)) @ factor.T
        inside = np.all((space.lower <= found[outside]) & (found[outside] <= space.upper), axis=1)
        outside = outside[~inside]
        if not outside.size:
            break
        if redraw:
            origin[outside] = particles[rng.choice(len(particles), len(outside), p=weights)]
    found[outside] = origin[outside]
    away = np.linalg.solve(factor, (found[:, None, :] - particles[None, :, :]).reshape(-1, space.size).T)
    densities = np.exp(-0.5 * (away**2).sum(axis=0)).reshape(count, len(particles)) @ weights
    return found, (1.0 / densities) / (1.0 / densities).sum()


def _factor(covariance: FloatArray, extent: FloatArray) -> FloatArray:
    """Return the Cholesky factor of a covariance, made wider where too few particles leave it without a width.

    Args:
        covariance: `(p, p)`, positive semidefinite up to rounding.
        extent: `(p,)`: widths of the bounds.
    """
    for share in LEAST_WIDTHS[:-1]:
        with suppress(np.linalg.LinAlgError):
            return np.asarray(np.linalg.cholesky(covariance + np.diag((share * extent) ** 2)))
    return np.asarray(np.linalg.cholesky(covariance + np.diag((LEAST_WIDTHS[-1] * extent) ** 2)))


def _interval(particles: Parameters, weights: FloatArray) -> FloatArray:
    """Return `(p, 2)`: the values between which 95 % of the weight lies."""
    ends = []
    for column in particles.T:
        order = np.argsort(column, kind="stable")
        below = np.cumsum(weights[order]) - weights[order] / 2
        ends.append(np.interp([0.025, 0.975], below, column[order]))
    return np.array(ends)
