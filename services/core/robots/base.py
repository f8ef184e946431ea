"""The contract of a robot: a world, genomes that describe its motion, and the fitness of a trajectory."""

from abc import abstractmethod
from typing import Any, ClassVar

from gaplab.services.core.arrays import FloatArray, Genome
from gaplab.services.core.registry import Plugin
from gaplab.services.core.types import Space
from gaplab.services.core.world import Motion, Trajectory, World


class Robot(Plugin):
    """A morphology with a genome space.

    Attributes:
        engine: the engine that runs it when a spec names none.
        unit: unit of its fitness.
        world: the robot in reality: its nominal world, whose coefficients are the default hidden truth.
        space: space of its genomes.
        known: `(g,)`, a hand-designed genome of middling fitness.
    """

    engine: ClassVar[str]
    unit: ClassVar[str]
    world: World
    space: Space
    known: Genome

    @abstractmethod
    def motion(self, genome: Genome) -> Motion:
        """Return the motion that the genome `(g,)` describes."""

    @abstractmethod
    def fitness(self, trajectory: Trajectory) -> FloatArray:
        """Return `(...)`: the fitness of each trajectory, maximised; nan where the physics failed."""

    @property
    def is_function(self) -> bool:
        """Whether the robot is a function of one gene: its curve can be drawn, and it has no body to replay."""
        return not self.world.bodies and self.space.size == 1

    @classmethod
    def details(cls) -> dict[str, Any]:
        """Return the default engine, the unit of fitness, the size of the genome, and whether it is a function."""
        robot = cls()
        return {"engine": cls.engine, "unit": cls.unit, "genes": robot.space.size, "function": robot.is_function}
