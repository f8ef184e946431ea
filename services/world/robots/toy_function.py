"""The paper's toy: a function of one number in place of a robot."""

import numpy as np

from gaplab.services.core.arrays import FloatArray, Genome, frozen
from gaplab.services.core.space import Space
from gaplab.services.world.motions import Motion, Trajectory
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.world import Material, World


class ToyFunction(Robot):
    """A function of one gene with a hill and a peak, which shows simulator tuning in seconds.

    Its world has no bodies, only a material, whose three coefficients shape the function. Its fitness is the speed.
    """

    name = "toy_function"
    source = "Paper, section 2, Fig. 3; the function itself is gaplab's"
    engine = "analytic"
    unit = "m/s"
    world = World(material=Material(static_friction=1.0, dynamic_friction=0.8, restitution=0.0))
    space = Space.box([0.0], [1.0])
    known = frozen([0.3])

    _start = frozen([0.0])
    _end = frozen([0.0, 1.0])

    def motion(self, genome: Genome) -> Motion:
        """Return the motion with the gene as the only target, for one second."""
        return Motion(times_s=self._start, targets=genome[None, :], observe_s=self._end)

    def fitness(self, trajectory: Trajectory) -> FloatArray:
        """Return `(...)`: the distance along x divided by time, in m/s."""
        distance_m = trajectory.positions_m[..., -1, 0] - trajectory.positions_m[..., 0, 0]
        return np.asarray(distance_m / (trajectory.times_s[-1] - trajectory.times_s[0]))
