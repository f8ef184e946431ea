"""Misfit: distance of tuned simulators from reality, and from each other over repetitions."""

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Statistic, TunableName, Unit


class Distribution(Frozen):
    """Statistics of a number over repetitions; null if too few repetitions have it."""

    n: int
    mean: Statistic
    sd: Statistic = Field(description="sample standard deviation")
    least: Statistic
    greatest: Statistic


class TunableDistribution(Distribution):
    """Statistics of the tuned value of one tunable."""

    name: TunableName
    lower: float = Field(description="lower bound of tuning", examples=[0.0])
    upper: float = Field(description="upper bound of tuning", examples=[0.6])
    at_lower: Statistic = Field(description="share of repetitions at the lower bound, within 1 % of the range")
    at_upper: Statistic = Field(description="share of repetitions at the upper bound, within 1 % of the range")


class MisfitPoint(Frozen):
    """The best simulators of one iteration; those of iteration 0 are random."""

    iteration: int
    error: Distribution = Field(
        description="root mean square of simulated minus real fitness, over the samples tuned on"
    )
    gap: Distribution = Field(
        description="absolute difference between simulated and real fitness of the transferred controller"
    )
    tunables: tuple[TunableDistribution, ...]


class MisfitRead(Frozen):
    """Misfit of an experiment, by iteration; empty for a strategy without samples, which tunes nothing."""

    experiment: Id
    unit: Unit = Field(description="unit of fitness, error and gap")
    points: tuple[MisfitPoint, ...]
    remarks: tuple[str, ...] = Field(
        description="sentences about the latest iteration", examples=[("restitution is at its lower bound, 0",)]
    )
