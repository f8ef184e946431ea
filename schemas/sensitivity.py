"""The sensitivity check: the effect of each tunable on fitness, before tuning."""

from enum import StrEnum
from typing import Annotated, ClassVar

from pydantic import Field

from gaplab.schemas.base import Count, Examples, Frozen, Id, Moment, Read, Statistic, TunableName, Unit
from gaplab.schemas.lifecycle import State
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.resolved import ResolvedTunable
from gaplab.schemas.spec import SharedSettings

POINTS, EVALUATIONS = 17, 100


class Verdict(StrEnum):
    """Verdict on a tunable; `unknown` if the physics failed too often."""

    NOTHING = "nothing"
    ROUGH = "rough"
    SMOOTH = "smooth"
    UNKNOWN = "unknown"


class SensitivitySpec(SharedSettings):
    """The settings of an experiment. The check uses its robot, engine and tunables."""

    EXAMPLES: ClassVar[Examples] = {
        "the least": {"summary": "The quadruped and the paper's three coefficients; about 800 rollouts", "value": {}},
        "finer": {
            "summary": "One coefficient between your own bounds, at more values",
            "value": {"tunables": [{"name": "restitution", "lower": 0.0, "upper": 0.3}], "points": 33},
        },
    }

    points: Annotated[Count, Field(ge=5, le=1_001)] = Field(
        POINTS, description="number of values of each tunable; eight controllers are simulated at each"
    )
    evaluations: Annotated[Count, Field(ge=20, le=100_000)] = Field(
        EVALUATIONS, description="evaluations of the short evolution of four of these controllers"
    )


class Checked(Frozen):
    """The complete subject of a check."""

    robot: PluginRef = Field(examples=["quadruped"])
    engine: PluginRef = Field(examples=["pybullet"])
    controller: PluginRef | None = Field(None, description="null: the robot's own", examples=["square_pulses"])
    task: PluginRef | None = Field(None, description="null: the robot's own", examples=["walk"])
    tunables: tuple[ResolvedTunable, ...] = Field(examples=[("restitution",)])
    points: int = POINTS
    evaluations: int = EVALUATIONS


class Sensitivity(Read):
    """Effect of one tunable on fitness between its bounds, with the others in the middle of theirs."""

    name: TunableName
    effect: Statistic = Field(
        description="standard deviation of fitness along the profile; null if the physics failed too often"
    )
    relative_effect: Statistic = Field(
        description="effect divided by the standard deviation of fitness between controllers"
    )
    roughness: Statistic = Field(
        description="share of the effect that is noise between neighbouring values: 0 smooth, 1 noise"
    )
    failures: int = Field(description="number of rollouts along the profile whose physics failed (nan)")
    verdict: Verdict
    values: tuple[float, ...] = Field(description="checked values of the tunable", examples=[(0.0, 0.3, 0.6)])
    fitness: tuple[tuple[float | None, ...], ...] = Field(
        description="fitness at each value, one row per controller: hand-designed, random, evolved",
        examples=[((0.31, 0.33, 0.28), (0.11, 0.12, 0.09))],
    )


class SensitivityRead(Read):
    """A sensitivity check. Its id is a hash of its subject, so equal subjects are checked once."""

    id: Id
    state: State
    spec: Checked
    rollouts: int = Field(description="upper bound on the rollouts of the check")
    unit: Unit = Field(description="unit of fitness")
    tunables: tuple[Sensitivity, ...] = Field((), description="results, once the check is COMPLETED")
    warnings: tuple[str, ...] = ()
    reason: str | None = Field(
        None, description="reason of failure, or of the last return to the queue", examples=["no heartbeat for 30 s"]
    )
    created_at: Moment
    started_at: Moment | None = None
    ended_at: Moment | None = None
