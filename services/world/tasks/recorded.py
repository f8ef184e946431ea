"""A task that reads what was recorded, and rates nothing."""

import numpy as np

from gaplab.schemas.base import Frozen
from gaplab.schemas.curves import OF_UNTUNED
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.world import robot_library
from gaplab.services.world.controllers.recorded import RecordedOptions
from gaplab.services.world.motions import Trajectory
from gaplab.services.world.pools import said
from gaplab.services.world.sensing import JOINTS, Sensors
from gaplab.services.world.tasks.base import Task
from gaplab.services.world.world import World


class RecordedTask(Task):
    """Nothing is rated; the sensors are those of a pool, at its times.

    Its unit is that of what is recorded: minus the error on held-out recordings, as a share of the untuned simulator's.
    A spec with a recorded reality gets it by itself.
    """

    name = "recorded"
    unit = OF_UNTUNED
    turned = False
    Options = RecordedOptions
    options: RecordedOptions

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        pool = robot_library.pool(self.options.sha256, self.options.name)
        self.observe_s = frozen(pool.times_s)
        self.sensors = Sensors(
            names=tuple(each.name for each in pool.sensors),
            units=tuple(each.unit for each in pool.sensors),
            noises=frozen([each.noise for each in pool.sensors]),
            times_s=self.observe_s,
        )
        self.joints = any(name.partition(" ")[0] in JOINTS for name in self.sensors.names)
        self._world = World()

    def prepare(self, world: World) -> None:
        """Learn the joints."""
        self._world = world

    def fitness(self, trajectory: Trajectory) -> FloatArray:
        """Return `(...)`: 0, or nan where the physics failed."""
        return np.where(np.isfinite(trajectory.positions_m).all(axis=(-2, -1)), 0.0, np.nan)

    def sense(self, trajectory: Trajectory) -> FloatArray:
        """Return `(..., r, s)`: what the sensors say; nan of joints that a trajectory does not have."""
        return said(self.sensors.names, trajectory, self._world)
