"""What tuned simulators expect of a controller, and the limits that its motion should keep."""

from typing import Annotated, Literal

from pydantic import Field

from gaplab.schemas.base import Frozen, Real, Statistic

Beyond = Literal["warn", "refuse"]
"""What happens to a controller that is expected to exceed a limit."""


class LimitsSpec(Frozen):
    """Limits of a physical robot; a missing one is not checked."""

    joint_speed: Annotated[Real, Field(gt=0, examples=[12.0])] | None = Field(
        default=None, description="greatest speed of a joint, rad/s"
    )
    torque: Annotated[Real, Field(gt=0, examples=[6.0])] | None = Field(
        default=None, description="greatest torque of a joint, N·m; checked only if the engine tells torques"
    )
    tilt: Annotated[Real, Field(gt=0, examples=[0.8])] | None = Field(
        default=None, description="greatest tilt of the base from upright, rad"
    )
    height: Annotated[Real, Field(examples=[0.08])] | None = Field(
        default=None, description="least height of the base's frame above the ground, m"
    )


class Safety(Frozen):
    """What tuned simulators expect of a controller; the worst of each.

    Attributes:
        simulators: number of simulators that were asked.
        failed: number of them in which the physics failed.
    """

    simulators: int
    failed: int
    joint_speed: float | None = Field(default=None, description="greatest speed of a joint, rad/s", examples=[8.1])
    torque: float | None = Field(default=None, description="greatest torque of a joint, N·m", examples=[6.5])
    tilt: float | None = Field(default=None, description="greatest tilt of the base from upright, rad", examples=[0.18])
    height: float | None = Field(default=None, description="least height of the base's frame, m", examples=[0.16])
    clearance: float | None = Field(
        default=None,
        description="least height of the lowest point of the base's body, m; negative inside the ground",
        examples=[0.12],
    )
    falls: int = Field(default=0, description="number of simulators in which it falls: it tilts by more than 90°")
    fitness_low: Statistic = Field(default=None, description="least fitness")
    fitness_high: Statistic = Field(default=None, description="greatest fitness")
    beyond: tuple[str, ...] = Field(default=(), description="limits of the spec that it exceeds, in words")
    unknown: tuple[str, ...] = Field(default=(), description="what could not be forecast, and why, in words")
