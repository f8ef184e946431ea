"""The sensitivity check: what each tunable does to fitness, before anything is tuned."""

from enum import StrEnum
from typing import Annotated, ClassVar

from pydantic import Field

from gaplab.schemas.base import Count, Examples, Frozen, Id, Moment, Statistic, TunableName, Unit
from gaplab.schemas.lifecycle import State
from gaplab.schemas.plugin import PluginRef, TunableRef
from gaplab.schemas.spec import Settings

POINTS, EVALUATIONS = 17, 100


class Verdict(StrEnum):
    """What a check says of a tunable; `unknown` where physics failed too often to say."""

    NOTHING = "nothing"
    ROUGH = "rough"
    SMOOTH = "smooth"
    UNKNOWN = "unknown"


class SensitivitySpec(Settings):
    """The settings of an experiment; of them, robot, engine and tunables are what is checked."""

    EXAMPLES: ClassVar[Examples] = {
        "the least": {"summary": "The quadruped and the paper's three coefficients; about 800 rollouts", "value": {}},
        "finer": {
            "summary": "One coefficient between your own bounds, at more values",
            "value": {"tunables": [{"name": "restitution", "lower": 0.0, "upper": 0.3}], "points": 33},
        },
    }

    points: Annotated[Count, Field(ge=5, le=1_001)] = Field(
        default=POINTS, description="values of each tunable; eight controllers are simulated at each"
    )
    evaluations: Annotated[Count, Field(ge=20, le=100_000)] = Field(
        default=EVALUATIONS, description="of the short evolution of each of four of these controllers"
    )


class Checked(Frozen):
    """What is checked, with nothing left out."""

    robot: PluginRef = Field(examples=["quadruped"])
    engine: PluginRef = Field(examples=["pybullet"])
    tunables: tuple[TunableRef, ...] = Field(examples=[("restitution",)])
    points: int = POINTS
    evaluations: int = EVALUATIONS


class Sensitivity(Frozen):
    """What one tunable does to fitness over its bounds, the others in the middle of theirs."""

    name: TunableName
    effect: Statistic = Field(
        description="standard deviation of fitness along the profile, in its unit; null where physics failed too often"
    )
    relative_effect: Statistic = Field(
        description="the effect over the standard deviation of fitness between controllers"
    )
    roughness: Statistic = Field(
        description="the part of the effect that jumps from value to value, over the effect: 0 smooth, 1 noise"
    )
    failures: int = Field(description="rollouts along the profile whose physics failed (nan)")
    verdict: Verdict
    values: tuple[float, ...] = Field(description="of the tunable", examples=[(0.0, 0.3, 0.6)])
    fitness: tuple[tuple[float | None, ...], ...] = Field(
        description="a row for each controller, at each value: the known one, random ones, evolved ones",
        examples=[((0.31, 0.33, 0.28), (0.11, 0.12, 0.09))],
    )


class SensitivityRead(Frozen):
    """A sensitivity check; its id is that of what is checked, so that the same is checked once."""

    id: Id
    state: State
    spec: Checked
    rollouts: int = Field(description="that the check takes at most")
    unit: Unit = Field(description="of fitness")
    tunables: tuple[Sensitivity, ...] = Field(default=(), description="once it is COMPLETED")
    warnings: tuple[str, ...] = ()
    reason: str | None = Field(
        default=None, description="why it failed, or was last queued again", examples=["no heartbeat for 30 s"]
    )
    created_at: Moment
    started_at: Moment | None = None
    ended_at: Moment | None = None
