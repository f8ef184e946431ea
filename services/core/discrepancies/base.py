"""The contract of a discrepancy: how much a simulator's answer about a sample differs from reality's."""

from abc import abstractmethod
from math import sqrt
from typing import ClassVar

from gaplab.services.core.arrays import FloatArray, Outcomes
from gaplab.services.core.registry import Plugin


class Discrepancy(Plugin):
    """Compares the outcomes of samples in simulation and in reality. Tuning minimises the sum over samples.

    Attributes:
        senses: true if it compares readings; false if fitness alone, which costs fewer observations.
        squares: true if a term is the sum of squared `residuals`, as some tuners need.
        error_text: what the error per sample is, in words.
    """

    senses: ClassVar[bool] = False
    squares: ClassVar[bool] = False
    catalogued = ("senses", "squares")
    error_text: ClassVar[str] = "root mean square difference between fitness in simulation and in reality"

    @abstractmethod
    def terms(self, simulated: Outcomes, measured: FloatArray, times_s: FloatArray) -> FloatArray:
        """Return `(n, m)`: how much each simulator differs on each sample; at least 0, nan where the physics failed.

        Args:
            simulated: `(n, m, 1 + q)`: fitness and readings of n samples in m simulators; q is 0 unless it `senses`.
            measured: `(n, 1 + q)`: the same in reality. Fitness is finite; a reading is nan if its sensor failed.
            times_s: `(q,)`: time of each reading, in seconds from the start of a rollout.
        """

    def lack(self, readings: FloatArray, times_s: FloatArray) -> str | None:  # noqa: ARG002 - for those that need some
        """Return what a sample with these readings `(q,)` lacks to be compared; None if nothing."""
        return None

    def residuals(self, simulated: Outcomes, measured: FloatArray, times_s: FloatArray) -> FloatArray:
        """Return `(n, m, r)`: differences whose squares sum to the terms, if it `squares`; arguments as of `terms`."""
        raise NotImplementedError(f"{self.name} is not a sum of squares")

    def noise(self, measured: FloatArray, times_s: FloatArray) -> float:  # noqa: ARG002 - for those that know it
        """Return the variance of a residual if the simulator is right; 0 if it is unknown; arguments as of `terms`."""
        return 0.0

    def floor(self, error: float) -> float:
        """Return the discrepancy of a simulator that errs by `error`, at least 0, on one sample alone."""
        return error**2

    def error(self, term: float) -> float:
        """Return the error of a simulator on samples whose mean term is this: the inverse of `floor`."""
        return sqrt(term)

    def error_unit(self, unit: str) -> str:
        """Return the unit of the error, given that of fitness: readings are in units of their noise."""
        return "× noise" if self.senses else unit

    def least_error(self, fitness_error: float) -> float:
        """Return the error below which simulators are equally good, given one of fitness; of readings, their noise."""
        return 1.0 if self.senses else fitness_error
