"""Misfit: distance of tuned simulators from reality, and from each other over repetitions."""

from enum import StrEnum

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Read, Statistic, TunableName, Unit


class Distribution(Frozen):
    """Statistics of a number over repetitions; null if too few repetitions have it."""

    n: int
    mean: Statistic
    sd: Statistic = Field(description="sample standard deviation")
    least: Statistic
    greatest: Statistic
    text: str = Field("", description="mean ± standard deviation", examples=["0.71 ± 0.02"])


class TunableDistribution(Distribution):
    """Statistics of the tuned value of one tunable."""

    name: TunableName
    lower: float = Field(description="lower bound of tuning", examples=[0.0])
    upper: float = Field(description="upper bound of tuning", examples=[0.6])
    at_lower: Statistic = Field(description="share of repetitions at the lower bound, within 1 % of the range")
    at_upper: Statistic = Field(description="share of repetitions at the upper bound, within 1 % of the range")
    at_bounds: str = Field("", description="both shares in words; empty: none is at a bound", examples=["50 % at 0"])
    spread: Statistic = Field(
        None, description="standard deviation over repetitions, over that of a uniform draw between the bounds"
    )
    interval: Statistic = Field(
        None, description="mean width of the 95 % intervals, over that of uniform draws; null if the tuner gives none"
    )
    posterior: Statistic = Field(
        None, description="mean standard deviation of the posterior, over that of uniform draws; null if there is none"
    )


class MisfitPoint(Frozen):
    """The best simulators of one iteration; those before the first sample are random."""

    iteration: int
    error: Distribution = Field(
        description="error per sample over the samples tuned on; by default the root mean square of simulated minus "
        "real fitness"
    )
    expected_error: Distribution = Field(
        description="error per sample that noise and rough physics alone would leave; no values where noise is unknown"
    )
    held_out_error: Distribution = Field(
        description="the same over the held-out samples, which no tuning sees; it has no values without any"
    )
    gap: Distribution = Field(
        description="absolute difference between simulated and real fitness of the transferred controller"
    )
    tunables: tuple[TunableDistribution, ...]


class Identification(StrEnum):
    """Verdict on a tunable; `unknown` with too few repetitions and no interval.

    `doubtful` where it would be identified, at least partly, but no simulator reproduces the samples: the value then
    makes up for what is missing.
    """

    IDENTIFIED = "identified"
    PARTLY = "partly identified"
    NOT = "not identified"
    DOUBTFUL = "doubtful"
    UNKNOWN = "unknown"


class TunableVerdict(Read):
    """Whether the samples determine a tunable."""

    name: TunableName
    verdict: Identification
    remaining: Statistic = Field(
        description="largest of spread, interval and posterior at the latest iteration: 1 is as uncertain as before "
        "any sample, 0 is certain"
    )
    sentence: str
    helps: tuple[str, ...] = Field(description="what would help, unless it is identified")


class MisfitRead(Read):
    """Misfit of an experiment, by iteration; empty for a strategy without samples, which tunes nothing."""

    experiment: Id
    unit: Unit = Field(description="unit of fitness and gap")
    error_unit: str = Field("", description="unit of errors, by default that of fitness", examples=["m/s", "× noise"])
    points: tuple[MisfitPoint, ...]
    remarks: tuple[str, ...] = Field(
        description="sentences about the latest iteration", examples=[("restitution is at its lower bound, 0",)]
    )
    unreproduced: str = Field(
        "", description="that no simulator reproduces the samples, in sentences; empty if one does, or noise is unknown"
    )
    held_out: float = Field(0.0, description="share of the samples that no tuning sees")
    noise: Statistic = Field(
        None,
        description="standard deviation of one measured value, pooled over the repeats of all samples and probes, in "
        "the unit of fitness; null: nothing was repeated",
    )
    verdicts: tuple[TunableVerdict, ...] = Field(
        (), description="which tunables the samples identify; none before the first sample"
    )
    note: str = Field("", description="what the verdicts mean, in sentences")
