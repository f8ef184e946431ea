"""The contract of a robot."""

import numpy as np

from gaplab.services.core.motions import Loop, Trajectory
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
    known, size = np.asarray(robot.known), robot.space.size
    assert known.shape == (size,), f"its known genome has the shape {known.shape}, its space {size} genes"
    inside = bool(np.all((known >= robot.space.lower) & (known <= robot.space.upper)))
    assert inside, f"its known genome {known.tolist()} is outside its bounds"


def drives_every_actuator(plugin: Plugin) -> None:
    """Describes motions with targets for every actuator, all observed at the same times."""
    robot = plugin.example()
    motions = [robot.motion(genome) for genome in robot.space.draw(20, np.random.default_rng(0))]
    actuators = len(robot.world.actuators) or 1
    same = all(np.array_equal(motion.observe_s, motions[0].observe_s) for motion in motions)
    assert same, "observe_s differs between genomes"
    for motion in motions:
        if isinstance(motion, Loop):
            continue  # its targets follow from what it observes
        expected = (len(motion.times_s), actuators)
        assert motion.targets.shape == expected, f"targets have the shape {motion.targets.shape}, not {expected}"
        assert motion.times_s[0] == 0.0, f"times_s begin at {motion.times_s[0]}, not at 0"
        assert np.all(np.diff(motion.times_s) > 0), "times_s do not ascend"


def rates_many_trajectories_as_each(plugin: Plugin) -> None:
    """Returns for many trajectories at once the fitness of each."""
    robot = plugin.example()
    observe_s = robot.motion(robot.known).observe_s
    positions_m = np.random.default_rng(0).normal(size=(4, 5, len(observe_s), 3))
    upright = np.broadcast_to([0.0, 0, 0, 1], (*positions_m.shape[:3], 4))
    together = np.asarray(robot.fitness(Trajectory(observe_s, positions_m, upright)))
    one_by_one = [
        [float(robot.fitness(Trajectory(observe_s, each, upright[0, 0]))) for each in row] for row in positions_m
    ]
    assert together.shape == (4, 5), f"its fitness of (4, 5) trajectories has the shape {together.shape}"
    assert np.allclose(together, one_by_one), "its fitness of many trajectories differs from that of each"


def has_no_fitness_of_failed_physics(plugin: Plugin) -> None:
    """Returns nan for a trajectory of nan."""
    robot = plugin.example()
    observe_s = robot.motion(robot.known).observe_s
    nothing = Trajectory(observe_s, np.full((len(observe_s), 3), np.nan), np.full((len(observe_s), 4), np.nan))
    fitness = float(robot.fitness(nothing))
    assert np.isnan(fitness), f"its fitness of a trajectory of nan is {fitness}"


CHECKS = (
    names_an_engine_that_runs_it,
    has_its_known_genome_in_its_space,
    drives_every_actuator,
    rates_many_trajectories_as_each,
    has_no_fitness_of_failed_physics,
)
