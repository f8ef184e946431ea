"""Fitness against the number of real-world evaluations, and the tests that compare two such curves."""

from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.schemas.lifecycle import State


class CurvePoint(Frozen):
    """Recorded fitness at one number of real-world evaluations, over the repetitions that have reached it.

    A statistic is null if it has too few repetitions.
    """

    evaluations: int
    n: int
    mean: float | None
    sd: float | None = Field(description="sample standard deviation")
    lower: float | None = Field(description="lower end of the 95 % interval of the mean, by Student's t")
    upper: float | None = Field(description="upper end of that interval")
    values: tuple[float | None, ...] = Field(description="fitness by repetition; null: not reached yet, or failed")


class Curve(Frozen):
    """The curve of one experiment.

    The direct baseline has a single point, at 0: it has no samples, because its controllers evolve in reality itself.
    """

    experiment: str
    name: str
    strategy: str
    state: State
    unit: str
    direct: bool = False
    points: tuple[CurvePoint, ...]


class Test(Frozen):
    """One statistical test between two groups."""

    __test__ = False

    statistic: float | None
    p: float | None = Field(description="two-sided p-value; null if undefined")
    p_holm: float | None = Field(default=None, description="p-value with Holm's correction over all pairs")
    degrees_of_freedom: float | None = None


class Comparison(Frozen):
    """Two experiments, compared by recorded fitness pooled over a range of numbers of real-world evaluations.

    Differences are `first` minus `second`.
    """

    first: str
    second: str
    from_evaluations: int
    to_evaluations: int
    n_first: int
    n_second: int
    difference: float | None = Field(description="difference of the means")
    effect_size: float | None = Field(description="Cohen's d: the difference divided by the pooled standard deviation")
    student: Test = Field(description="Student's t-test, which the paper uses")
    welch: Test
    mann_whitney: Test
