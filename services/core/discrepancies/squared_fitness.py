"""The paper's discrepancy."""

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
