"""The paper's task: to walk as far as possible."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen, Real
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.world.motions import Trajectory
from gaplab.services.world.sensing import Sensors
from gaplab.services.world.tasks.base import Task

SENSED_EVERY_S = 0.25
"""Interval between readings of the sensors."""

TILT_NOISE_RAD, PLACE_NOISE_M = 0.02, 0.005
"""Noise of the sensors: gaplab's defaults, of a cheap inertial sensor and a camera above the floor."""


class WalkOptions(Frozen):
    """Options of the task `walk`."""

    settling_s: Annotated[Real, Field(ge=0, le=600)] = Field(
        default=0.5, description="seconds before fitness counts: the robot drops to the ground and starts its gait"
    )
    counted_s: Annotated[Real, Field(gt=0, le=600)] = Field(
        default=2.5, description="seconds in which fitness counts, after settling; the cost of a rollout grows with it"
    )
    direction: Literal["any", "forward"] = Field(
        default="any", description="`any`: the distance over ground; `forward`: the distance along x"
    )


class Walk(Task):
    """The distance over ground during `counted_s`, after `settling_s`, divided by that time."""

    name = "walk"
    source = "Paper, section 2"
    unit = "m/s"
    Options = WalkOptions
    options: WalkOptions

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        settling_s, counted_s = self.options.settling_s, self.options.counted_s
        self.observe_s = frozen([settling_s, settling_s + counted_s])
        times = np.arange(1, np.floor(counted_s / SENSED_EVERY_S) + 1) * SENSED_EVERY_S
        self.sensors = Sensors(
            names=("roll", "pitch", "height", "x", "y"),
            units=("rad", "rad", "m", "m", "m"),
            noises=frozen([TILT_NOISE_RAD] * 2 + [PLACE_NOISE_M] * 3),
            times_s=frozen(settling_s + times),
            periods=frozen([2 * np.pi, 0.0, 0.0, 0.0, 0.0]),
        )

    def fitness(self, trajectory: Trajectory) -> FloatArray:
        """Return `(...)`: the distance between first and last observation, divided by the time between them."""
        travelled = trajectory.positions_m[..., -1, :2] - trajectory.positions_m[..., 0, :2]
        if self.options.direction == "forward":
            return np.asarray(travelled[..., 0] / (trajectory.times_s[-1] - trajectory.times_s[0]))
        squares = travelled * travelled
        distances = np.sqrt(squares[..., 0] + squares[..., 1])
        return np.asarray(distances / (trajectory.times_s[-1] - trajectory.times_s[0]))

    def sense(self, trajectory: Trajectory) -> FloatArray:
        """Return `(..., r, 5)`: roll and pitch of the trunk, its height, and its place on the ground from the start."""
        x, y, z, w = trajectory.orientations.reshape(-1, 4).T  # numpy is twice as fast with vectors
        values = np.empty((len(x), 5))
        values[:, 0] = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        values[:, 1] = np.arcsin(np.minimum(np.maximum(2 * (w * y - z * x), -1.0), 1.0))
        places = trajectory.positions_m.reshape(-1, 3)
        values[:, 2], values[:, 3:] = places[:, 2], places[:, :2]
        return values.reshape(*trajectory.positions_m.shape[:-1], 5)
