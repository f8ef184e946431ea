"""The contract of a robot."""

from functools import partial

import numpy as np

from gaplab.services.contract import promises
from gaplab.services.core.arrays import NO_READINGS, FloatArray, Genome, Genomes, frozen
from gaplab.services.core.motions import Loop
from gaplab.services.core.robots.base import Robot
from gaplab.services.engines import engines

Plugin = type[Robot]


def names_an_engine_that_runs_it(plugin: Plugin) -> None:
    """Names an engine that can run it."""
    robot = plugin.example()
    assert robot.engine in engines, f"its engine {robot.engine!r} is none of {', '.join(engines)}"
    assert engines[robot.engine].runs(robot.world), f"its engine {robot.engine!r} cannot run its world"


def has_its_known_genome_in_its_space(plugin: Plugin) -> None:
    """Has a known genome within the bounds of its space."""
    robot = plugin.example()
    promises.check_known(robot.known, robot.space)


def drives_every_actuator(plugin: Plugin) -> None:
    """Describes motions with finite targets for every actuator, all observed at the same times."""
    robot = plugin.example()
    observe_s = robot.motion(frozen(robot.known)).observe_s
    for genome in _genomes(robot):
        motion = robot.motion(genome)
        assert np.array_equal(motion.observe_s, observe_s), "observe_s differs between genomes"
        if isinstance(motion, Loop):
            finite = np.isfinite(promises.numbers(robot, robot.world, genome[None])).all()
            assert finite, "targets or memories are not finite"
        else:
            promises.check_targets(motion, len(robot.world.actuators) or 1)


def repeats_itself(plugin: Plugin) -> None:
    """Describes the same motion by the same genome, whatever it was asked before."""
    *_, one, other = _genomes(plugin.example())
    questions = {
        "the motion of a genome": partial(_moved, genome=one),
        "the motion of another genome": partial(_moved, genome=other),
    }
    advice = "use no random numbers, and keep nothing from one genome for the next"
    promises.check_repeats(plugin.example, questions, advice)


def observes_at_times_that_ascend(plugin: Plugin) -> None:
    """Observes at times that ascend, in arrays of float64, the last of them above 0; its sensors are read within."""
    robot = plugin.example()
    promises.check_times(_observe_s(robot), robot.sensors)


def rates_many_trajectories_as_each(plugin: Plugin) -> None:
    """Returns for many trajectories at once the fitness of each."""
    robot = plugin.example()
    promises.check_rates_many(robot, _observe_s(robot))


def has_no_fitness_of_failed_physics(plugin: Plugin) -> None:
    """Returns nan for a trajectory of nan."""
    robot = plugin.example()
    promises.check_failed_physics(robot, _observe_s(robot))


def reads_its_sensors(plugin: Plugin) -> None:
    """Reads each sensor at each of its times, and many trajectories as each."""
    robot = plugin.example()
    if robot.sensors.size:
        can = plugin.sense is not Robot.sense or hasattr(robot, "_task")
        assert can, "it has sensors, but neither a task nor a `sense` that reads them"
        promises.check_sensors(robot)


def _genomes(robot: Robot) -> Genomes:
    """Return the known genome, the corners that are the bounds, and drawn ones, `(23, g)`, read-only."""
    space = robot.space
    return frozen(np.vstack([robot.known, space.lower, space.upper, space.draw(20, np.random.default_rng(0))]))


def _observe_s(robot: Robot) -> FloatArray:
    return robot.motion(frozen(robot.known)).observe_s


def _moved(robot: Robot, genome: Genome) -> FloatArray:
    """Return all numbers of a motion as one vector: times of observation, then times and targets, or those of calls."""
    motion = robot.motion(genome)
    times_s = NO_READINGS if isinstance(motion, Loop) else motion.times_s
    found = promises.numbers(robot, robot.world, genome[None])
    return np.concatenate([np.ravel(each) for each in (motion.observe_s, times_s, found)])


CHECKS = (
    names_an_engine_that_runs_it,
    has_its_known_genome_in_its_space,
    drives_every_actuator,
    repeats_itself,
    observes_at_times_that_ascend,
    rates_many_trajectories_as_each,
    has_no_fitness_of_failed_physics,
    reads_its_sensors,
)
