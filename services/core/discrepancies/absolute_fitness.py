"""The discrepancy of Back-to-Reality."""

import numpy as np

from gaplab.services.core.arrays import FloatArray, Outcomes
from gaplab.services.core.discrepancies.base import Discrepancy


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
