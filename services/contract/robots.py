"""The contract of a robot."""

from functools import partial

import numpy as np

from gaplab.services.contract import promises
from gaplab.services.core.arrays import NO_READINGS, FloatArray, Genome, Genomes, frozen
from gaplab.services.engines import engines
from gaplab.services.world.motions import Loop
from gaplab.services.world.robots.base import Robot

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


def _genomes(robot: Robot) -> Genomes:
    """Return the known genome, the corners that are the bounds, and drawn ones, `(23, g)`, read-only."""
    space = robot.space
    return frozen(np.vstack([robot.known, space.lower, space.upper, space.draw(20, np.random.default_rng(0))]))


def _moved(robot: Robot, genome: Genome) -> FloatArray:
    """Return all numbers of a motion as one vector: times of observation, then times and targets, or those of calls."""
    motion = robot.motion(genome)
    times_s = NO_READINGS if isinstance(motion, Loop) else motion.times_s
    found = promises.numbers(robot, robot.world, genome[None])
    return np.concatenate([np.ravel(each) for each in (motion.observe_s, times_s, found)])
