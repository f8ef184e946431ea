"""The paper's task: to walk as far as possible."""

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen, Real
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.world.motions import Trajectory
from gaplab.services.world.tasks.base import Noise, ReadingTask, ReadOptions, Sensor, left_out


class WalkOptions(ReadOptions):
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
    noise_tilt: Noise | None = left_out("noise of roll and pitch, rad; left out: 0.02, that of an inertial sensor")


class Walk(ReadingTask):
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
        self.read_during(settling_s, counted_s)

    def base(self) -> Sequence[Sensor]:
        """Return roll and pitch of the trunk, its height, and its place on the ground from the start."""
        tilt, place = self.noise("tilt"), self.noise("place")
        places = [(name, "m", place, 0.0) for name in ("height", "x", "y")]
        return [("roll", "rad", tilt, 2 * np.pi), ("pitch", "rad", tilt, 0.0), *places]

    def fitness(self, trajectory: Trajectory) -> FloatArray:
        """Return `(...)`: the distance between first and last observation, divided by the time between them."""
        travelled = trajectory.positions_m[..., -1, :2] - trajectory.positions_m[..., 0, :2]
        if self.options.direction == "forward":
            return np.asarray(travelled[..., 0] / (trajectory.times_s[-1] - trajectory.times_s[0]))
        squares = travelled * travelled
        distances = np.sqrt(squares[..., 0] + squares[..., 1])
        return np.asarray(distances / (trajectory.times_s[-1] - trajectory.times_s[0]))

    def look(self, trajectory: Trajectory) -> FloatArray:
        """Return `(..., r, 5)`: what the sensors of `base` say."""
        x, y, z, w = trajectory.orientations.reshape(-1, 4).T  # numpy is twice as fast with vectors
        values = np.empty((len(x), 5))
        values[:, 0] = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        values[:, 1] = np.arcsin(np.minimum(np.maximum(2 * (w * y - z * x), -1.0), 1.0))
        places = trajectory.positions_m.reshape(-1, 3)
        values[:, 2], values[:, 3:] = places[:, 2], places[:, :2]
        return values.reshape(*trajectory.positions_m.shape[:-1], 5)
