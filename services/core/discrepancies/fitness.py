"""Discrepancies of fitness: the paper's, that of Back-to-Reality, and one that a mistyped number does not move."""

from typing import Annotated

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen, Real
from gaplab.services.core.arrays import FloatArray, Outcomes
from gaplab.services.core.discrepancies.base import Discrepancy


class SquaredFitness(Discrepancy):
    """The squared difference between simulated and real fitness."""

    name = "squared_fitness"
    source = "Paper, section 2: the denominator of f(sim)"
    squares = True

    def terms(self, simulated: Outcomes, measured: FloatArray, times_s: FloatArray) -> FloatArray:  # noqa: ARG002 - the contract's
        """Return the squared differences, in the unit of fitness squared."""
        return (simulated[..., 0] - measured[:, None, 0]) ** 2

    def residuals(self, simulated: Outcomes, measured: FloatArray, times_s: FloatArray) -> FloatArray:  # noqa: ARG002 - the contract's
        """Return the differences, one for each sample."""
        return simulated[..., :1] - measured[:, None, :1]


class AbsoluteFitness(Discrepancy):
    """The absolute difference between simulated and real fitness: one odd sample weighs less than if squared."""

    name = "absolute_fitness"
    source = "Zagal, Ruiz-del-Solar and Vallejos 2004, as surveyed"
    error_text = "mean absolute difference between fitness in simulation and in reality"

    def terms(self, simulated: Outcomes, measured: FloatArray, times_s: FloatArray) -> FloatArray:  # noqa: ARG002 - the contract's
        """Return the absolute differences, in the unit of fitness."""
        return np.abs(simulated[..., 0] - measured[:, None, 0])

    def floor(self, error: float) -> float:
        """Return the error itself."""
        return error

    def error(self, term: float) -> float:
        """Return the term itself."""
        return term


class HuberOptions(Frozen):
    """Options of the discrepancy `huber`."""

    beyond: Annotated[Real, Field(gt=0, le=1e6)] = Field(
        default=0.05, description="difference from which it counts in proportion, in the unit of fitness"
    )


class Huber(Discrepancy):
    """Huber's loss of fitness: the squared difference, but in proportion to it beyond a limit.

    A sample of 31 in place of 0.31 pulls on the simulators no more than one that is off by the limit.
    """

    name = "huber"
    source = "Huber 1964, Robust estimation of a location parameter; twice his loss, so that small terms are squares"
    squares = True
    error_text = "root of the mean Huber loss of fitness in simulation against reality"
    Options = HuberOptions
    options: HuberOptions

    def terms(self, simulated: Outcomes, measured: FloatArray, times_s: FloatArray) -> FloatArray:  # noqa: ARG002 - the contract's
        """Return the losses, in the unit of fitness squared."""
        return self._loss(np.abs(simulated[..., 0] - measured[:, None, 0]))

    def residuals(self, simulated: Outcomes, measured: FloatArray, times_s: FloatArray) -> FloatArray:  # noqa: ARG002 - the contract's
        """Return the roots of the losses with the signs of the differences, one for each sample."""
        away = simulated[..., :1] - measured[:, None, :1]
        return np.copysign(np.sqrt(self._loss(np.abs(away))), away)

    def floor(self, error: float) -> float:
        """Return the loss of a difference."""
        return float(self._loss(np.asarray(error)))

    def error(self, term: float) -> float:
        """Return the difference that has this loss."""
        limit = self.options.beyond
        return float(np.sqrt(term)) if term <= limit**2 else (term / limit + limit) / 2

    def _loss(self, away: FloatArray) -> FloatArray:
        limit = self.options.beyond
        return np.where(away <= limit, away**2, limit * (2 * away - limit))
