"""Fitness against the number of real-world evaluations, and the tests that compare two such curves."""

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Name, Statistic, Unit
from gaplab.schemas.lifecycle import State


class CurvePoint(Frozen):
    """Recorded fitness at one number of real-world evaluations, over the repetitions that have reached it.

    A statistic is null if it has too few repetitions.
    """

    evaluations: int
    n: int
    mean: Statistic
    sd: Statistic = Field(description="sample standard deviation")
    lower: Statistic = Field(description="lower end of the 95 % interval of the mean, by Student's t")
    upper: Statistic = Field(description="upper end of that interval")
    values: tuple[Statistic, ...] = Field(description="fitness by repetition; null: not reached yet, or failed")


class Curve(Frozen):
    """The curve of one experiment.

    A strategy without samples has a single point, at 0, which is a level across the figure. The direct baseline is one:
    its controllers evolve in reality itself.
    """

    experiment: Id
    name: Name
    strategy: Name
    state: State
    unit: Unit
    direct: bool = Field(default=False, description="true for the direct baseline, which evolves in reality itself")
    level: bool = Field(default=False, description="true for a strategy without samples: a level across the figure")
    points: tuple[CurvePoint, ...]


class Test(Frozen):
    """One statistical test between two groups."""

    __test__ = False

    statistic: Statistic
    p: Statistic = Field(description="two-sided p-value; null if undefined")
    p_holm: Statistic = Field(default=None, description="p-value with Holm's correction over all pairs")
    degrees_of_freedom: Statistic = None


class Comparison(Frozen):
    """Two experiments, compared by recorded fitness pooled over a range of numbers of real-world evaluations.

    Differences are `first` minus `second`.
    """

    first: Id
    second: Id
    first_name: Name = ""
    second_name: Name = ""
    from_evaluations: int
    to_evaluations: int
    caution: str | None = Field(
        default=None,
        description="why not to trust the tests of a pooled range; null at a single number",
        examples=["pooled as in the paper: …"],
    )
    n_first: int
    n_second: int
    difference: Statistic = Field(description="difference of the means")
    effect_size: Statistic = Field(description="Cohen's d: the difference divided by the pooled standard deviation")
    student: Test = Field(description="Student's t-test, which the paper uses")
    welch: Test
    mann_whitney: Test
