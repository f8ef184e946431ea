"""The contract of a task: how long a rollout lasts, what is fit, and what is read."""

from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.registry import Plugin
from gaplab.services.world.motions import Trajectory
from gaplab.services.world.sensing import Sensors


class Task(Plugin):
    """Rates what any robot does.

    Attributes:
        unit: unit of fitness.
        observe_s: `(t,)`, ascending: times at which a trajectory is observed for its fitness; the last one ends it.
        sensors: what is read during a rollout; by default nothing.
    """

    unit: ClassVar[str]
    observe_s: FloatArray
    sensors: Sensors = Sensors()

    @abstractmethod
    def fitness(self, trajectory: Trajectory) -> FloatArray:
        """Return `(...)`: the fitness of each trajectory, maximised; nan where the physics failed."""

    def sense(self, trajectory: Trajectory) -> FloatArray:
        """Return `(..., r, s)`: what the sensors say, in their units, of trajectories observed at `sensors.times_s`."""
        return np.empty((*trajectory.positions_m.shape[:-1], len(self.sensors.names)))

    @classmethod
    def details(cls) -> dict[str, Any]:
        """Return the unit of fitness and the sensors, for the catalogue."""
        return {"unit": cls.unit, **cls().sensors.details()}
