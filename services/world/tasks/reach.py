"""A task of arms: to hold a tool at a place."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen, Real
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.world.motions import Trajectory
from gaplab.services.world.tasks.base import ReadingTask, ReadOptions

RATED_EVERY_S = 0.05
"""Interval between the distances whose mean is the fitness."""

Metres = Annotated[Real, Field(ge=-100, le=100)]


class ReachOptions(ReadOptions):
    """Options of the task `reach`."""

    x_m: Metres = Field(default=0.3, description="target, along x from the origin of the world")
    y_m: Metres = Field(default=0.2, description="target, along y")
    z_m: Metres = Field(default=0.5, description="target, above the ground")
    settling_s: Annotated[Real, Field(ge=0, le=600)] = Field(
        default=1.0, description="seconds before fitness counts, in which the robot may approach the target"
    )
    counted_s: Annotated[Real, Field(gt=0, le=600)] = Field(
        default=1.0, description="seconds in which fitness counts; the cost of a rollout grows with it"
    )
    measure: Literal["distance", "reduction"] = Field(
        default="distance",
        description="`distance`: minus the mean distance; `reduction`: the distance at the start minus the mean",
    )


class Reach(ReadingTask):
    """Minus the mean distance of the observed body from a target place, during `counted_s` after `settling_s`.

    Name the body in the robot, as its observed one, such as the last link of an arm. Distances are those of its frame.
    By default the sensors are the place of the body.
    """

    name = "reach"
    unit = "m"
    Options = ReachOptions
    options: ReachOptions

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        given = self.options
        self._target = frozen([given.x_m, given.y_m, given.z_m])
        intervals = max(1, round(given.counted_s / RATED_EVERY_S))
        counted = given.settling_s + np.linspace(0.0, given.counted_s, intervals + 1)
        self.observe_s = frozen(np.unique([0.0, *counted]))
        self._first = len(self.observe_s) - len(counted)
        self.read_during(0.0, given.settling_s + given.counted_s)

    def fitness(self, trajectory: Trajectory) -> FloatArray:
        """Return `(...)`: minus the mean distance; for `reduction`, plus the distance at the start."""
        away = trajectory.positions_m - self._target
        distances = np.sqrt((away * away).sum(axis=-1))
        mean = distances[..., self._first :].mean(axis=-1)
        return np.asarray(distances[..., 0] - mean if self.options.measure == "reduction" else -mean)
