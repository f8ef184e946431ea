"""Fitness against the number of real-world evaluations, and the tests that compare two such curves."""

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, PluginName, Statistic, Unit
from gaplab.schemas.lifecycle import State


class CurvePoint(Frozen):
    """The recorded fitness after so many real-world evaluations, over the repetitions that got there.

    A statistic is null where too few repetitions are there to have one.
    """

    evaluations: int
    n: int
    mean: Statistic
    sd: Statistic = Field(description="sample standard deviation")
    lower: Statistic = Field(description="of the 95 % interval of the mean, by Student's t")
    upper: Statistic
    values: tuple[Statistic, ...] = Field(description="by repetition; null: not there yet, or failed")


class Curve(Frozen):
    """The curve of one experiment.

    The direct baseline has one point, at 0: it has no samples, its controllers evolve in reality itself.
    """

    experiment: Id
    name: PluginName
    strategy: PluginName
    state: State
    unit: Unit
    direct: bool = False
    points: tuple[CurvePoint, ...]


class Test(Frozen):
    """One test between two groups."""

    __test__ = False

    statistic: Statistic
    p: Statistic = Field(description="two-sided; null where it is undefined")
    p_holm: Statistic = Field(default=None, description="after Holm's correction over the family")
    degrees_of_freedom: Statistic = None


class Comparison(Frozen):
    """Two experiments compared on the recorded fitness at a range of counts of real-world evaluations, pooled.

    `first` minus `second` throughout.
    """

    first: Id
    second: Id
    from_evaluations: int
    to_evaluations: int
    n_first: int
    n_second: int
    difference: Statistic = Field(description="of the means")
    effect_size: Statistic = Field(description="Cohen's d: the difference over the pooled standard deviation")
    student: Test = Field(description="the paper's test")
    welch: Test
    mann_whitney: Test
