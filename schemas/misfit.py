"""Misfit: distance of tuned simulators from reality, and from each other over repetitions."""

from pydantic import Field

from gaplab.schemas.base import Frozen


class Spread(Frozen):
    """Statistics of a number over repetitions; null if too few repetitions have it."""

    n: int
    mean: float | None
    sd: float | None = Field(description="sample standard deviation")
    least: float | None
    greatest: float | None


class TunedSpread(Spread):
    """Statistics of the tuned value of one tunable."""

    name: str
    lower: float = Field(description="lower bound of tuning")
    upper: float = Field(description="upper bound of tuning")
    at_lower: float | None = Field(description="share of repetitions at the lower bound, within 1 % of the range")
    at_upper: float | None = Field(description="share of repetitions at the upper bound, within 1 % of the range")


class MisfitPoint(Frozen):
    """The best simulators of one iteration; those of iteration 0 are random."""

    iteration: int
    error: Spread = Field(description="root mean square of simulated minus real fitness, over the samples tuned on")
    gap: Spread = Field(
        description="absolute difference between simulated and real fitness of the transferred controller"
    )
    tunables: tuple[TunedSpread, ...]


class MisfitRead(Frozen):
    """Misfit of an experiment, by iteration. The direct baseline tunes nothing, so it has none."""

    experiment: str
    unit: str = Field(description="unit of fitness, error and gap")
    points: tuple[MisfitPoint, ...]
    remarks: tuple[str, ...] = Field(description="sentences about the latest iteration")
