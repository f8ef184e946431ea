"""Results as the API returns them: samples and simulators, curves, and misfit. A null fitness means a failure."""

from enum import StrEnum

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Moment, Name, Statistic, TunableName, Unit
from gaplab.schemas.lifecycle import State


class MeasurementKind(StrEnum):
    """Purpose of a real-world evaluation: samples are learned from and counted, probes are only recorded."""

    SAMPLE = "sample"
    PROBE = "probe"


class SampleRead(Frozen):
    """A real-world evaluation: the genome, its fitness and its readings."""

    repetition: int
    iteration: int
    kind: MeasurementKind
    genome: tuple[float, ...] = Field(examples=[(0.12, 0.55, 0.83, 0.31)])
    fitness: Statistic
    readings: tuple[float | None, ...] | None = Field(
        default=None,
        description="what the sensors said, each divided by its noise, all sensors at one time after the other; null: "
        "the robot has none, or a sensor failed",
        examples=[(0.4, -1.2, None)],
    )
    repeats: tuple[float, ...] | None = Field(
        default=None, description="values whose mean is the fitness; null: it is a single value", examples=[(0.4, 0.44)]
    )
    standard_error: Statistic = Field(
        default=None, description="standard error of the fitness, from its repeats; null: it is a single value"
    )
    measured_by: str = Field(examples=["pybullet"])
    measured_at: Moment


class SensorsRead(Frozen):
    """The sensors of a robot, and the times at which all of them are read; it may have none."""

    names: tuple[str, ...] = Field(examples=[("roll", "height")])
    units: tuple[str, ...] = Field(examples=[("rad", "m")])
    noises: tuple[float, ...] = Field(
        description="standard deviation of each sensor's noise, in its unit", examples=[(0.02, 0.005)]
    )
    times_s: tuple[float, ...] = Field(description="seconds from the start of a rollout", examples=[(0.75, 1.0)])
    needed: bool = Field(
        default=False, description="true: an answer without readings is refused, since the experiment tunes on them"
    )


class SimulatorRead(Frozen):
    """A tuned simulator; rank 0 is the best of its iteration."""

    repetition: int
    iteration: int
    rank: int
    parameters: dict[str, float] = Field(examples=[{"static_friction": 1.04, "restitution": 0.02}])
    squared_error: Statistic = Field(
        description="discrepancy, summed over the samples so far, which grows with their number; by default squared "
        "differences in fitness; null if the physics failed on one"
    )
    error: Statistic = Field(
        default=None,
        description="error per sample, in the unit of the discrepancy; by default the root mean square difference in "
        "fitness; null without samples too",
    )
    intervals: dict[str, tuple[float, float]] | None = Field(
        default=None,
        description="95 % interval of each tunable, if the tuner gives them",
        examples=[{"dynamic_friction": (0.7, 0.9)}],
    )
    expected_error: Statistic = Field(
        default=None, description="error that noise and rough physics alone would leave; null if noise is unknown"
    )
    surprise: Statistic = Field(
        default=None,
        description="share of right simulators that leave as much error; up to 0.05, no simulator reproduces the "
        "samples. Intervals are widened by what is left",
    )
    weight: Statistic = Field(default=None, description="share of the posterior probability, if the tuner gives it")
    held_out_error: Statistic = Field(default=None, description="discrepancy from held-out samples, of rank 0")


def from_before(*counts: int) -> str:
    """Return ` (and 12 from before)`, or ` (and 0–12 from before)`, of numbers of samples; "" without any."""
    span = "\N{EN DASH}".join(map(str, sorted({min(counts, default=0), max(counts, default=0)})))
    return "" if span == "0" else f" (and {span} from before)"


class Fitness(StrEnum):
    """Whose fitness in reality counts after each number of real-world evaluations.

    The paper's `recorded` is the larger of the transferred controller's and the best sample's, `transferred` that of
    the transferred controller alone, `equal_chances` the best of those so far: as many for every strategy.
    """

    RECORDED = "recorded"
    TRANSFERRED = "transferred"
    EQUAL_CHANCES = "equal_chances"

    @property
    def words(self) -> str:
        """What it is, as a heading begins with it."""
        return {
            Fitness.RECORDED: "Recorded fitness",
            Fitness.TRANSFERRED: "Fitness of transferred controllers alone",
            Fitness.EQUAL_CHANCES: "Best fitness of the controllers transferred so far",
        }[self]


class CurvePoint(Frozen):
    """Fitness at one number of real-world evaluations, over the repetitions that have reached it.

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
    fitness: Fitness = Fitness.RECORDED
    direct: bool = Field(default=False, description="true for the direct baseline, which evolves in reality itself")
    level: bool = Field(default=False, description="true for a strategy without samples: a level across the figure")
    known: int = Field(default=0, description="samples from before the experiment, which no point counts")
    points: tuple[CurvePoint, ...]
    best_of: tuple[Statistic, ...] = Field(
        default=(),
        description="for the direct baseline, the expected largest fitness of 1, 2, 3 … of its repetitions, up to half "
        "of them; empty if it has fewer than 20. Recorded fitness after e samples is the largest of e + 1 controllers",
    )


class Distribution(Frozen):
    """Statistics of a number over repetitions; null if too few repetitions have it."""

    n: int
    mean: Statistic
    sd: Statistic = Field(description="sample standard deviation")
    least: Statistic
    greatest: Statistic
    text: str = Field(default="", description="mean ± standard deviation", examples=["0.71 ± 0.02"])


class TunableDistribution(Distribution):
    """Statistics of the tuned value of one tunable."""

    name: TunableName
    lower: float = Field(description="lower bound of tuning", examples=[0.0])
    upper: float = Field(description="upper bound of tuning", examples=[0.6])
    at_lower: Statistic = Field(description="share of repetitions at the lower bound, within 1 % of the range")
    at_upper: Statistic = Field(description="share of repetitions at the upper bound, within 1 % of the range")
    at_bounds: str = Field(
        default="", description="both shares in words; empty: none is at a bound", examples=["50 % at 0"]
    )
    spread: Statistic = Field(
        default=None, description="standard deviation over repetitions, over that of a uniform draw between the bounds"
    )
    interval: Statistic = Field(
        default=None,
        description="mean width of the 95 % intervals, over that of uniform draws; null if the tuner gives none",
    )
    posterior: Statistic = Field(
        default=None,
        description="mean standard deviation of the posterior, over that of uniform draws; null if there is none",
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


class TunableVerdict(Frozen):
    """Whether the samples determine a tunable."""

    name: TunableName
    verdict: Identification
    remaining: Statistic = Field(
        description="largest of spread, interval and posterior at the latest iteration: 1 is as uncertain as before "
        "any sample, 0 is certain",
    )
    sentence: str
    helps: tuple[str, ...] = Field(description="what would help, unless it is identified")


class MisfitRead(Frozen):
    """Misfit of an experiment, by iteration; empty for a strategy without samples, which tunes nothing."""

    experiment: Id
    unit: Unit = Field(description="unit of fitness and gap")
    error_unit: str = Field(
        default="", description="unit of errors, by default that of fitness", examples=["m/s", "× noise"]
    )
    points: tuple[MisfitPoint, ...]
    remarks: tuple[str, ...] = Field(
        description="sentences about the latest iteration", examples=[("restitution is at its lower bound, 0",)]
    )
    unreproduced: str = Field(
        default="",
        description="that no simulator reproduces the samples, in sentences; empty if one does, or noise is unknown",
    )
    held_out: float = Field(default=0.0, description="share of the samples that no tuning sees")
    noise: Statistic = Field(
        default=None,
        description="standard deviation of one measured value, pooled over the repeats of all samples and probes, in "
        "the unit of fitness; null: nothing was repeated",
    )
    verdicts: tuple[TunableVerdict, ...] = Field(
        default=(), description="which tunables the samples identify; none before the first sample"
    )
    note: str = Field(default="", description="what the verdicts mean, in sentences")
