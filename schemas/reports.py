"""The verdict on a study or an experiment: what its curves and tests say, in words."""

from enum import StrEnum

from pydantic import Field

from gaplab.schemas.base import Id, Name, Read, Statistic


class Trend(StrEnum):
    """The end of a curve; `too_few`: too few repetitions or evaluations to say."""

    RISING = "rising"
    FLAT = "flat"
    FALLING = "falling"
    UNCLEAR = "unclear"
    TOO_FEW = "too_few"


class TrendRead(Read):
    """The end of one curve, by the paired gain of its repetitions."""

    experiment: Id
    name: Name
    trend: Trend
    n: int = Field(description="repetitions with a value at both ends of the gain", examples=[20])
    since: int | None = Field(description="number of evaluations at which the gain begins", examples=[3])
    last: int = Field(description="number of evaluations at which the gain ends", examples=[10])
    gain: Statistic = Field(description="mean gain in recorded fitness between the two")
    lower: Statistic = Field(description="lower end of its 95 % interval, by Student's t")
    upper: Statistic = Field(description="upper end of that interval")
    continuing: bool | None = Field(description="whether continuing is worthwhile; null: the data do not say")
    sentence: str = Field(examples=["Random is flat since iteration 3; not worth continuing."])


class VerdictRead(Read):
    """The verdict, computed by stated rules from curves and tests."""

    headline: str = Field(examples=["No pair differs at 10 real-world evaluations."])
    sentences: tuple[str, ...] = Field(examples=[("Simulated fit reaches 94 % of the direct baseline.",)])
    trends: tuple[TrendRead, ...]
    evaluations: int | None = Field(
        description="last number of real-world evaluations that the experiments share; strategies are compared there; "
        "null without results",
        examples=[10],
    )
    rules: tuple[str, ...] = Field(
        description="the rules of the verdict", examples=[("A pair differs if its p after Holm is below 0.05.",)]
    )

    def __str__(self) -> str:
        return "\n".join((self.headline, *self.sentences))
