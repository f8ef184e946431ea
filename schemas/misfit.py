"""Misfit: how far tuned simulators are from reality, and from each other when tuning is repeated."""

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Statistic, TunableName, Unit


class Spread(Frozen):
    """A number over repetitions; null where too few have it."""

    n: int
    mean: Statistic
    sd: Statistic = Field(description="sample standard deviation")
    least: Statistic
    greatest: Statistic


class TunedSpread(Spread):
    """The value that tuning gave a tunable."""

    name: TunableName
    lower: float = Field(description="its bound", examples=[0.0])
    upper: float = Field(examples=[0.6])
    at_lower: Statistic = Field(description="share of repetitions within 1 % of the bounds' distance of it")
    at_upper: Statistic


class MisfitPoint(Frozen):
    """The best simulators after so many iterations; those of iteration 0 are random."""

    iteration: int
    error: Spread = Field(
        description="root mean square, over the samples it was tuned on, of simulated minus real fitness"
    )
    gap: Spread = Field(
        description="size of what fitness the controller evolved in it has there minus in reality: not tuned on"
    )
    tunables: tuple[TunedSpread, ...]


class MisfitRead(Frozen):
    """The misfit of an experiment, by iteration; the direct baseline tunes nothing, and has none."""

    experiment: Id
    unit: Unit = Field(description="of fitness, and so of error and gap")
    points: tuple[MisfitPoint, ...]
    remarks: tuple[str, ...] = Field(
        description="the latest iteration in sentences", examples=[("restitution is at its lower bound, 0",)]
    )
