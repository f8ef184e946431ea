"""A driver for `gaplab drive`: replace the pretended robot in it by yours."""

from numpy.random import default_rng

from gaplab import DriverMotion
from gaplab.plugins import Motion, PluginRef, engines, frozen, robots


class Driver:
    """Runs motions on the robot, and measures how fast it walks."""

    def connect(self) -> None:
        """Connect once, before the first run: here, to a simulation in place of a serial port."""
        self.robot = robots.create(PluginRef(name="quadruped"))
        self.engine = engines["pybullet" if engines["pybullet"].available() else "mujoco"]()
        self.noise = default_rng()

    def run(self, motion: DriverMotion) -> float:
        """Run a motion once and return the fitness in m/s; raise gaplab.MeasurementFailed if there is none.

        A robot with sensors returns `(fitness, readings)`: a row for each time of reading and a column for each sensor,
        in its unit, None or NaN where it failed. `client.experiment(ID).sensors` has their times, names and order.

        `motion.times_s` has the times at which targets change, `motion.targets` a row of targets for each: one for
        each name in `motion.actuators`, in its unit in `motion.units`. The run ends at `motion.observe_s[-1]`.
        `motion.start` has the angle of each joint before it: move there slowly, and rest.
        """
        expected = tuple(joint.name for joint in self.robot.world.actuators)
        if motion.actuators != expected:
            raise ValueError(f"the motion is for {motion.actuators}, but the {self.robot.name} has {expected}")
        sent = Motion(frozen(motion.times_s), frozen(motion.targets), frozen(motion.observe_s))
        path = self.engine.rollouts([self.robot.world], [sent])
        return float(self.robot.fitness(path)[0, 0]) + self.noise.normal(0, 0.005)

    def stop(self) -> None:
        """Let the robot stand still, at once: called at the end, and from another thread if a run must not go on."""
