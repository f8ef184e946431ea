"""The contract of a controller: genomes, and how each drives the actuators of a robot."""

from abc import abstractmethod
from typing import ClassVar

from gaplab.services.core.arrays import FloatArray, Genome
from gaplab.services.core.registry import Plugin
from gaplab.services.core.space import Space
from gaplab.services.world.motions import Loop, Motion
from gaplab.services.world.world import World


class Controller(Plugin):
    """Drives the actuators of any robot, as a genome says.

    Attributes:
        loops: true if it observes while it acts, so that its motions are Loops.
        space: space of its genomes, once it is prepared.
        known: `(g,)`, a hand-designed genome of it, once it is prepared; a robot may know a better one.
    """

    loops: ClassVar[bool] = False
    catalogued = ("loops",)
    space: Space
    known: Genome

    @abstractmethod
    def prepare(self, world: World, observe_s: FloatArray) -> None:
        """Set `space` and `known`; called once, before any motion.

        Args:
            world: robot to drive: the actuators, in the order of targets.
            observe_s: `(t,)`, times of observation of every motion; the last one ends it.
        """

    @abstractmethod
    def motion(self, genome: Genome) -> Motion | Loop:
        """Return the motion that the genome `(g,)` describes."""
