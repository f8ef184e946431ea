"""The contract of a robot: a world, genomes that describe its motion, the fitness of a trajectory, and its sensors."""

from abc import abstractmethod
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from gaplab.services.core.arrays import FloatArray, Genome, no_readings
from gaplab.services.core.registry import Plugin
from gaplab.services.core.space import Space
from gaplab.services.core.world import Motion, Trajectory, World


@dataclass(frozen=True, eq=False)
class Sensors:
    """The sensors of a robot, and the times at which all of them are read.

    Attributes:
        names: name of each of the s sensors.
        units: unit of each.
        noises: `(s,)`: standard deviation of each sensor's noise, in its unit.
        times_s: `(r,)`, ascending: seconds from the start of a rollout.
    """

    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    noises: FloatArray = field(default_factory=no_readings)
    times_s: FloatArray = field(default_factory=no_readings)

    @property
    def size(self) -> int:
        """Return the number of readings of a rollout, q = r · s: all sensors at the first time, then at the next."""
        return len(self.names) * len(self.times_s)

    @property
    def reading_times_s(self) -> FloatArray:
        """Return the time of each reading, `(q,)`."""
        return np.repeat(self.times_s, len(self.names))

    def details(self) -> dict[str, Any]:
        """Return name, unit and noise of each sensor, and the times of reading, for the catalogue."""
        named = zip(self.names, self.units, self.noises.tolist(), strict=True)
        sensors = [{"name": name, "unit": unit, "noise": noise} for name, unit, noise in named]
        return {"sensors": sensors, "reading_times_s": self.times_s.tolist()}

    def standardised(self, values: FloatArray) -> FloatArray:
        """Return readings `(..., q)`, each divided by its noise, from values `(..., r, s)` in the sensors' units."""
        return (values / self.noises).reshape(*values.shape[:-2], self.size)

    def values(self, readings: FloatArray) -> FloatArray:
        """Return values `(..., r, s)` in the sensors' units, from readings `(..., q)`."""
        return readings.reshape(*readings.shape[:-1], len(self.times_s), len(self.names)) * self.noises


class Robot(Plugin):
    """A morphology with a genome space.

    Attributes:
        engine: the engine that runs it when a spec names none.
        unit: unit of its fitness.
        world: the robot in reality: its nominal world, whose coefficients are the default hidden truth.
        space: space of its genomes.
        known: `(g,)`, a hand-designed genome of middling fitness.
        sensors: what it senses during a rollout; by default nothing.
    """

    engine: ClassVar[str]
    unit: ClassVar[str]
    world: World
    space: Space
    known: Genome
    sensors: Sensors = Sensors()

    @abstractmethod
    def motion(self, genome: Genome) -> Motion:
        """Return the motion that the genome `(g,)` describes."""

    @abstractmethod
    def fitness(self, trajectory: Trajectory) -> FloatArray:
        """Return `(...)`: the fitness of each trajectory, maximised; nan where the physics failed."""

    def sense(self, trajectory: Trajectory) -> FloatArray:
        """Return `(..., r, s)`: what the sensors say, in their units, of trajectories observed at `sensors.times_s`."""
        return np.empty((*trajectory.positions_m.shape[:-1], len(self.sensors.names)))

    @property
    def is_function(self) -> bool:
        """Whether the robot is a function of one gene: its curve can be drawn, and it has no body to replay."""
        return not self.world.bodies and self.space.size == 1

    @classmethod
    def details(cls) -> dict[str, Any]:
        """Return the default engine, the unit of fitness, the number of genes, the sensors, and if it is a function."""
        robot = cls()
        return {
            "engine": cls.engine,
            "unit": cls.unit,
            "genes": robot.space.size,
            "function": robot.is_function,
            **robot.sensors.details(),
        }
