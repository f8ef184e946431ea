"""A driver for `gaplab drive`: replace the pretended robot in it by yours."""

from numpy.random import default_rng

from gaplab.api.clients.motions import DriverMotion
from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.arrays import frozen
from gaplab.services.core.motions import Motion
from gaplab.services.core.robots import robots
from gaplab.services.specs.assembly import engine_of
from gaplab.services.specs.default_engines import default_engine


class Driver:
    """Runs motions on the robot, and measures how fast it walks."""

    def connect(self) -> None:
        """Connect once, before the first run: here, to a simulation in place of a serial port."""
        self.robot = robots.create(PluginRef(name="quadruped"))
        self.engine = engine_of(PluginRef(name=default_engine(self.robot)))
        self.noise = default_rng()

    def run(self, motion: DriverMotion) -> float:
        """Run a motion once and return the fitness in m/s; raise gaplab.MeasurementFailed if there is none.

        `motion.times_s` has the times at which targets change, `motion.targets` a row of targets for each: one for
        each name in `motion.actuators`, in its unit in `motion.units`. The run ends at `motion.observe_s[-1]`.
        """
        sent = Motion(frozen(motion.times_s), frozen(motion.targets), frozen(motion.observe_s))
        path = self.engine.rollouts([self.robot.world], [sent])
        return float(self.robot.fitness(path)[0, 0]) + self.noise.normal(0, 0.005)

    def stop(self) -> None:
        """Let the robot stand still, at once: called at the end, and from another thread if a run takes too long."""
