"""Samples and simulators, as the API returns them. A fitness of null means failed physics or a failed measurement."""

from enum import StrEnum

from pydantic import Field

from gaplab.schemas.base import Frozen, Moment, Statistic


class MeasurementKind(StrEnum):
    """Purpose of a real-world evaluation: samples are learned from and counted, probes are only recorded."""

    SAMPLE = "sample"
    PROBE = "probe"


class SampleRead(Frozen):
    """A real-world evaluation."""

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
